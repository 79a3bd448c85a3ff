// SPDX-License-Identifier: Apache-2.0
// Chooses how x0, f and y are propagated to N x (core/propagator/README.md).

#ifndef DLCS_CORE_DRIVER_PROPAGATOR_CHOICE_H_
#define DLCS_CORE_DRIVER_PROPAGATOR_CHOICE_H_

#include <memory>
#include <optional>
#include <string>

#include "core/matrix_classes/matrix_class.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/propagator/propagator.h"

namespace dlcs {

class SetupCache;

// Of the trials for a tolerance the first one has so many steps.
inline constexpr Index kFirstTrialSteps = 64;

struct PropagatorChoice {
  std::shared_ptr<Propagator> system;  // null: dense matrices
  PropagatorRecord record;             // before the solve
  double factor_nonzeros = 0;          // predicted, with kSparseStepping; 0 if not known
  std::string refusal;                 // why no propagator can be used; empty if one can
};

// The propagator for a solve by `method`. If the options leave it open: dense matrices if A is dense or small; else the
// form that fits the structure of A; else dense matrices again, if their matrix functions are affordable. If the method
// is open too, time stepping with sparse factors is preferred to contours and dense matrices where it is predicted to
// take less time, by the fill of its factors and the number of steps. Time stepping is iterative where sparse factors
// do not fit into options.max_memory or are predicted to take longer. `selection` is that of the plan. `setups` may be
// null; it holds what solves of the same matrices share, and must outlive the choice.
PropagatorChoice ChoosePropagator(const Problem& problem, const Options& options, Method method, Selection selection,
                                  SetupCache* setups = nullptr);

// The system in the form in which it is solved; absent if that is `problem` itself. Two things may change.
// Matrices become sparse, if A was given as dense but is large, at most a twentieth of its entries are nonzero, and the
// options leave the propagator open: dense products would take minutes where sparse steps take milliseconds.
// A mass matrix E is multiplied out (WithoutMass()), except where A is sparse and large, E not diagonal, and the
// methods that the options allow use factors of zE - A.
// Cost: one pass over all entries; with E that of WithoutMass().
std::optional<Problem> FormToSolve(const Problem& problem, const Options& options);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_PROPAGATOR_CHOICE_H_
