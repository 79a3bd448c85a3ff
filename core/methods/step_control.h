// SPDX-License-Identifier: Apache-2.0
// How fast trial solves converge, and the step that a tolerance needs.

#ifndef DLCS_CORE_METHODS_STEP_CONTROL_H_
#define DLCS_CORE_METHODS_STEP_CONTROL_H_

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/methods/grid.h"
#include "core/problem.h"
#include "core/solution.h"

namespace dlcs {

// What trials with ever half the step have shown.
class Convergence {
 public:
  // `difference` of the finest trial to the one before.
  void Add(double difference) { differences_.push_back(difference); }
  bool empty() const { return differences_.empty(); }
  double last_difference() const { return differences_.back(); }

  // Two ratios of differences are seen: trajectories with kinks converge unevenly, and one ratio alone is
  // luck.
  bool shows_order() const { return differences_.size() >= 3; }
  // The lower of the last two orders, within what the methods have: [1/2, 2]. One until two are seen.
  double order() const;
  // Of the finest trial: the last difference, or what the one before lets expect if that is more, divided by
  // 2^order - 1. Needs a difference; NaN where one was not finite.
  double error() const;

 private:
  std::vector<double> differences_;
};

// The largest difference of a row, relative to its largest value in `fine`. A row that is less than a
// millionth of the largest one counts as that much: it has no accuracy of its own. NaN where a number is not
// finite.
double RelativeDifference(const Matrix& coarse, const Matrix& fine);

struct StepControl {
  double tolerance =
      0;  // for x of the solution, and for B y where `y_counts`, as RelativeDifference() measures
  bool y_counts = false;
  Index most_steps = 0;  // of a trial
  Index nodes_kept =
      0;  // grids up to so many steps become output altogether, and of finer ones the nodes of these
};

struct ControlledSolution {
  Solution solution;  // of the finest trial
  // Estimated, as `tolerance`; NaN where no two trials reached the end.
  double error = std::numeric_limits<double>::quiet_NaN();
  double order = 1;      // that was seen
  bool reached = false;  // the error is below the tolerance
};

// Solves on `grid` and on grids with half the step, a quarter and so on, until the estimated error of the
// finest is below a safe part of the tolerance. `solve` is one solve on a grid; its steps must be short
// enough for the method to converge, not for the tolerance. The nodes of `grid` are output nodes of every
// trial.
//
// The error is estimated from the differences of neighbouring trials at all output nodes of the coarser one,
// with the order that they show; the estimate must be three times below the tolerance. A trial that fails is
// taken as a step too long: the next one has half of it, up to kMostFailingSteps; failures that no step mends
// are returned at once, as are Cancelled and errors. Trials end without success where the next one would have
// more than `most_steps`, or where even second order would need a hundred times that. Cost: twice that of the
// last trial. Memory: the trajectories of two trials.
absl::StatusOr<ControlledSolution> SolveToTolerance(
    const Problem& problem, const StepControl& control, Grid grid,
    const std::function<absl::StatusOr<Solution>(const Grid&)>& solve);

// Leaves only the columns of `solution` that stand at `wanted`, some of its times, increasing.
void KeepTimes(const std::vector<double>& wanted, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_STEP_CONTROL_H_
