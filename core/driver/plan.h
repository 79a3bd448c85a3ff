// SPDX-License-Identifier: Apache-2.0
// What a solve will do and why, decided before its first step.

#ifndef DLCS_CORE_DRIVER_PLAN_H_
#define DLCS_CORE_DRIVER_PLAN_H_

#include <optional>

#include "absl/status/statusor.h"
#include "core/discretization/grid.h"
#include "core/driver/method_choice.h"
#include "core/driver/propagator_choice.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

class SetupCache;

struct Plan {
  MatrixClass matrix_class;
  Selection selection;
  MethodChoice method;
  PropagatorChoice propagator;
  Grid grid;                   // the steps; or only where output is wanted, with finds_steps()
  double predicted_bytes = 0;  // as PredictBytes(); 0 where no form serves
  // The steepest piece of y as a function of q, where an iteration has to see whether it jumps.
  std::optional<double> largest_slope;

  const std::string& refusal() const { return method.refusal; }
  bool is_refused() const { return !method.refusal.empty(); }
  // The steps are found by an error, not given.
  bool finds_steps(const Options& options) const {
    return options.error_tolerance > 0 || method.method == Method::kEventDriven;
  }
};

// For the sound `problem` and `options`: what M is, which solution is meant, the method and the propagator, and how
// much memory they take. Left to itself it takes time_stepping where the exponential of A is out of reach. A solve that
// nothing serves, or that needs more than options.max_memory, is a plan with a refusal. `setups` may be null. Errors:
// as SelectRule(). Cost: that of Classify() and of the propagator's set-up.
absl::StatusOr<Plan> MakePlan(const Problem& problem, const Options& options, SetupCache* setups);

// Chooses method and propagator once more, for plan.selection and by other `options`.
void ChooseAgain(const Problem& problem, const Options& options, SetupCache* setups, Plan& plan);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_PLAN_H_
