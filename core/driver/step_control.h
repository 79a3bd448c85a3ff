// SPDX-License-Identifier: Apache-2.0
// How fast solves on ever finer grids converge, and the step that a tolerance needs.

#ifndef DLCS_CORE_DRIVER_STEP_CONTROL_H_
#define DLCS_CORE_DRIVER_STEP_CONTROL_H_

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/context/component_errors.h"
#include "core/discretization/grid.h"
#include "core/problem/solution.h"

namespace dlcs {

// What grids, each with half the step of the one before, have shown.
class Convergence {
 public:
  // `expected` is the order of the method where the solution is smooth.
  explicit Convergence(double expected = 2) : expected_(expected) {}

  // Of the trajectory on the finest grid to that on the grid before.
  void Add(ComponentErrors differences);
  bool empty() const { return differences_.empty(); }
  double last_difference() const { return differences_.back().largest(); }

  // Two ratios of differences are seen: trajectories with kinks converge unevenly, and one ratio alone is luck.
  bool shows_order() const { return differences_.size() >= 3; }
  // The lowest of the orders seen, within [1/2, expected]; 1 until one is.
  double order() const;
  // Of the finest trajectory: the last differences, or what those before let expect where that is more, times
  // `safety` / (2^order - 1). Needs a difference; NaN where one was not finite.
  ComponentErrors errors(double safety = 1) const;

 private:
  double expected_;
  std::vector<ComponentErrors> differences_;
};

// The estimate times this is reported, since the errors of kinks that fall between nodes come and go from one grid to
// the next. By trial, the truth was up to 2.04 times the estimate on tests/cases and the examples of the papers with 64
// to 262144 steps, and 11 times on one of 293 random systems (tests/core/driver/error_figure_test.cc, other seeds).
inline constexpr double kSafety = 5;
// The same for three grids of given steps, whose figure may be somewhat low, but should not frighten.
inline constexpr double kSafetyOfComparison = 3;

struct StepControl {
  double tolerance = 0;
  double expected_order = 2;
  Index most_steps = 0;      // of a trial
  Index most_steps_all = 0;  // of all trials together; 0 for any number
  Index nodes_kept = 0;      // grids up to so many steps become output altogether, and of finer ones the nodes of these
  bool whole_horizon = false;  // is one iteration: where it does not converge, shorter steps do not help
};

// What is solved with the data rounded otherwise (core/event_driven/rounded_data.h) differs from what it is compared
// with by so many ulps: of two solves on one grid, the figure is what some ulps make, and of the coarsest of three
// grids, whose difference counts a quarter.
inline constexpr double kRoundedUlps = 4;
inline constexpr double kRoundedUlpsOfCoarsest = 16;

struct TrialSolves {
  std::function<absl::StatusOr<Solution>(const Grid&)> solve;
  // With the data changed by so many ulps; empty where that is not known to do.
  std::function<absl::StatusOr<Solution>(const Grid&, double ulps)> solve_rounded = {};
  std::function<ComponentErrors(const Solution& coarse, const Solution& fine)> compare;
  std::function<bool(const Grid&)> fits;  // into the memory that is allowed
};

struct ControlledSolution {
  Solution solution;     // of the finest trial; its accuracy is set
  double order = 1;      // that was seen
  double rounding = 0;   // what part of the error is that of the data, and of rounding
  bool reached = false;  // the error is below the tolerance
};

// Solves on `grid` and on grids with half the step, a quarter and so on, until the error of the finest is below the
// tolerance. The steps of `grid` must be short enough for the method to converge, not for the tolerance. Its nodes are
// output nodes of every trial.
//
// The error is estimated from the differences of neighboring trials at all output nodes of the coarser one, with the
// order that they show. A trial that fails is taken as a step too long: the next one has half of it, up to
// kMostFailingSteps; failures that no step mends are returned at once, as are Cancelled and errors. Trials end without
// success where the next one would have more steps than `control` allows or would not fit into memory, where even
// second order would need a hundred times as many, or where other rounding of the data moves the solution by more than
// the tolerance: the first trial whose error is below a thousandth is solved with such data too. Cost: twice that of
// the last trial. Memory: the trajectories of two trials, of three at that one.
absl::StatusOr<ControlledSolution> SolveToTolerance(const StepControl& control, Grid grid, const TrialSolves& trials);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_STEP_CONTROL_H_
