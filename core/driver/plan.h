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
  Grid grid;                   // the steps; with finds_steps() only the output times
  double predicted_bytes = 0;  // as PredictBytes(); 0 if no propagator can be used
  // The largest slope of y as a function of q (LargestSlope()), set if an iteration has to check y for jumps.
  std::optional<double> largest_slope;

  const std::string& refusal() const { return method.refusal; }
  bool is_refused() const { return !method.refusal.empty(); }
  // The steps are chosen for an error tolerance, not given.
  bool finds_steps(const Options& options) const {
    return options.error_tolerance > 0 || method.method == Method::kEventDriven;
  }
};

// Makes the plan for valid `problem` and `options`: the class of M, the selected solution, the method, the propagator,
// and the predicted memory. If the options leave the method open and the exponential of A is too expensive, the method
// is time_stepping. If nothing can solve the problem, or it needs more than options.max_memory, the plan holds a
// refusal. `setups` may be null. Errors: as SelectRule(). Cost: that of Classify() and of the propagator's set-up.
absl::StatusOr<Plan> MakePlan(const Problem& problem, const Options& options, SetupCache* setups);

// Chooses method and propagator again, for plan.selection and other `options`.
void ChooseAgain(const Problem& problem, const Options& options, SetupCache* setups, Plan& plan);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_PLAN_H_
