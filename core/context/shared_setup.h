// SPDX-License-Identifier: Apache-2.0
// The set-up of a step length, shared with other solves of the same matrices where there is a cache.

#ifndef DLCS_CORE_CONTEXT_SHARED_SETUP_H_
#define DLCS_CORE_CONTEXT_SHARED_SETUP_H_

#include <functional>
#include <memory>
#include <string>

#include "core/context/solve_context.h"

namespace dlcs {

// The scheme `kind` ("exp-PL", "theta 0", ...) of the context's problem for `step`: that of the cache, or the one that
// `make` makes. The bits are the same.
Scheme SharedScheme(const SolveContext& context, const std::string& kind, double step,
                    const std::function<Scheme(double step)>& make);

// The solver of LCP(q, M + K), fresh: a clone of that of the cache, whose tests of M + K were made once.
std::unique_ptr<LcpSolver> SharedCoupledSolver(const SolveContext& context, const Matrix& K);

// What M is, as Classify(); `setups` may be null.
MatrixClass SharedClass(const Problem& problem, SetupCache* setups);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_SHARED_SETUP_H_
