// SPDX-License-Identifier: Apache-2.0
// The set-up of a step length, shared with other solves of the same matrices where there is a cache.

#ifndef DLCS_CORE_CONTEXT_SHARED_SETUP_H_
#define DLCS_CORE_CONTEXT_SHARED_SETUP_H_

#include <functional>
#include <memory>
#include <string>

#include "core/context/solve_context.h"

namespace dlcs {

// The scheme `kind` ("exp-PL", "theta 0", ...) of the context's problem for `step`: from the cache, or else made by
// `make`. The bits are the same either way.
Scheme SharedScheme(const SolveContext& context, const std::string& kind, double step,
                    const std::function<Scheme(double step)>& make);

// A new solver of LCP(q, M + K): a clone of the one in the cache, which has classified M + K already.
std::unique_ptr<LcpSolver> SharedCoupledSolver(const SolveContext& context, const Matrix& K);

// The class of M, as Classify() returns it, from the cache if it is there. `setups` may be null.
MatrixClass SharedClass(const Problem& problem, SetupCache* setups);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_SHARED_SETUP_H_
