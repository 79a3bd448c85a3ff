// SPDX-License-Identifier: Apache-2.0
// How x0, f and y are to be carried to N x.

#ifndef DLCS_CORE_DRIVER_PROPAGATOR_CHOICE_H_
#define DLCS_CORE_DRIVER_PROPAGATOR_CHOICE_H_

#include <memory>
#include <optional>
#include <string>

#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/propagator/propagator.h"

namespace dlcs {

class SetupCache;

struct PropagatorChoice {
  std::shared_ptr<Propagator> system;  // null: dense matrices
  PropagatorRecord record;                // before the solve
  std::string refusal;                     // why none serves; empty where one does
};

// For a solve by `method`. Left to itself: dense matrices where A is dense or small; else the form that its structure
// has; else dense ones again as far as their matrix functions are affordable, and where the method is left open too,
// not beside many constraints: time stepping with sparse factors serves there. `setups`, where given, lends and keeps
// what solves of the same matrices share, and must outlive the choice.
PropagatorChoice ChoosePropagator(const Problem& problem, const Options& options, Method method,
                                    SetupCache* setups = nullptr);

// `problem` with only the nonzero entries of A, B, N and M stored, where A was given as dense, is large and has at most
// a twentieth of its entries, and the choice is left open: products of dense matrices would take minutes where sparse
// steps take milliseconds. Nothing otherwise. Cost: one look at every entry.
std::optional<Problem> WithSparseMatrices(const Problem& problem, const Options& options);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_PROPAGATOR_CHOICE_H_
