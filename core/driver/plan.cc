// SPDX-License-Identifier: Apache-2.0
#include "core/driver/plan.h"

#include <utility>

#include "core/context/shared_setup.h"
#include "core/driver/memory_prediction.h"
#include "core/format_number.h"
#include "core/matrix_classes/lipschitz.h"
#include "core/stepping/iterative_step.h"

namespace dlcs {
namespace {

// Whether two implicit stages are of second order in x. Where y is not a Lipschitz function of x, the state must at
// least be consistent inside smooth intervals, since the second stage extrapolates what the first has moved: so it is
// where a pair with M_ii = 0 bounds one state that y acts on, an obstacle.
bool AreTwoStagesOfSecondOrder(const Problem& problem, Selection selection) {
  return IsAlwaysLipschitz(selection) || (selection == Selection::kAny && IterativeStep::WhyNot(problem).empty());
}

void ChooseForm(const Problem& problem, const Options& options, SetupCache* setups, Plan& plan) {
  plan.propagator = ChoosePropagator(problem, options, plan.method.method, plan.selection, setups);
  const bool any_propagator = options.propagator == PropagatorKind::kAuto ||
                              options.propagator == PropagatorKind::kSparseStepping ||
                              options.propagator == PropagatorKind::kIterativeStepping;
  if (!plan.propagator.refusal.empty() && options.method == Method::kAuto && any_propagator) {
    plan.method.method = Method::kTimeStepping;
    plan.method.reason = plan.propagator.refusal;
    plan.propagator = ChoosePropagator(problem, options, plan.method.method, plan.selection, setups);
    const bool is_left_open = options.theta == 0 && !options.average_y;
    plan.method.two_stages = is_left_open && AreTwoStagesOfSecondOrder(problem, plan.selection) &&
                             (plan.propagator.record.used == PropagatorKind::kSparseStepping ||
                              plan.propagator.record.used == PropagatorKind::kIterativeStepping);
    if (plan.method.two_stages) plan.method.reason += ". Steps have two stages, of second order";
  }
  plan.method.refusal = plan.propagator.refusal;
}

// What the nodes alone and the trajectory take, before any of it is made.
double LeastBytes(const Problem& problem, double steps, const Options& options) {
  const double outputs = options.output_times_only ? static_cast<double>(options.output_times.size()) : steps + 1;
  const auto numbers = static_cast<double>(2 + problem.num_states() + 2 * problem.num_constraints());
  return sizeof(double) * (steps + 1 + outputs * numbers);
}

void RefuseForMemory(double bytes, const Options& options, Plan& plan) {
  plan.predicted_bytes = bytes;
  plan.method.refusal = "The solve needs about " + FormatNumber(bytes) + " bytes, more than " +
                        MemoryLimitText(options) +
                        ". Ask for fewer steps or output times, or for a propagator that needs less.";
}

}  // namespace

absl::StatusOr<Plan> MakePlan(const Problem& problem, const Options& options, SetupCache* setups) {
  MatrixClass matrix_class = SharedClass(problem, setups);
  const auto selection = SelectRule(problem.rule, matrix_class);
  if (!selection.ok()) return selection.status();
  Plan plan{.matrix_class = std::move(matrix_class),
            .selection = *selection,
            .method = {},
            .propagator = {},
            .grid = {},
            .predicted_bytes = 0,
            .largest_slope = {}};
  const std::vector<double> break_points = BreakPoints(problem);
  const double least = LeastBytes(problem, CountSteps(problem.horizon, break_points, options), options);
  if (!(least <= options.max_memory)) {
    plan.method = ChooseMethod(problem, options, plan.matrix_class, plan.selection);
    plan.grid.times = {0};
    if (!plan.is_refused()) RefuseForMemory(least, options, plan);
    return plan;
  }
  plan.grid = MakeGrid(problem.horizon, break_points, options);
  ChooseAgain(problem, options, setups, plan);
  return plan;
}

void ChooseAgain(const Problem& problem, const Options& options, SetupCache* setups, Plan& plan) {
  plan.method = ChooseMethod(problem, options, plan.matrix_class, plan.selection);
  plan.propagator = {};
  plan.predicted_bytes = 0;
  if (plan.is_refused()) return;
  const bool iterates =
      plan.method.method == Method::kLaplaceIteration || plan.method.method == Method::kWuChenIteration;
  if (iterates && !IsAlwaysLipschitz(plan.selection)) {
    // Where the iterates do not jump it is their Lipschitz constant.
    plan.largest_slope = plan.matrix_class.lipschitz = LargestSlope(problem.M);
  }
  ChooseForm(problem, options, setups, plan);
  if (plan.is_refused()) return;
  plan.predicted_bytes = PredictBytes(problem, plan.grid, plan.method.method, plan.propagator);
  if (plan.predicted_bytes > options.max_memory) RefuseForMemory(plan.predicted_bytes, options, plan);
}

}  // namespace dlcs
