// SPDX-License-Identifier: Apache-2.0
// Finds the step for an error tolerance from the convergence of solves on finer and finer grids.

#ifndef DLCS_CORE_DRIVER_STEP_CONTROL_H_
#define DLCS_CORE_DRIVER_STEP_CONTROL_H_

#include <functional>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/context/component_errors.h"
#include "core/discretization/grid.h"
#include "core/driver/source_resolution.h"
#include "core/problem/options.h"
#include "core/problem/solution.h"

namespace dlcs {

// The observed convergence of solves on grids, each with half the step of the one before.
class Convergence {
 public:
  // `expected` is the order of the method where the solution is smooth.
  explicit Convergence(double expected = 2) : expected_(expected) {}

  // Adds the differences between the trajectories on the finest grid and on the grid before it, the largest of which is
  // `relative` of the size of its component.
  void Add(ComponentValues differences, double relative);
  bool empty() const { return differences_.empty(); }
  double last_difference() const { return differences_.back().relative; }

  // At least two ratios of differences are known. One is not enough, since trajectories with kinks converge unevenly.
  bool shows_order() const { return differences_.size() >= 3; }
  // The lowest observed order, within [1/2, expected]; 1 before there is one.
  double order() const;
  // The same where differences show it.
  std::optional<double> observed_order() const;
  // The estimated errors of the finest trajectory: the last differences, or those extrapolated from earlier differences
  // if they are larger, times `safety` / (2^order - 1). Needs a difference; NaN if one is not finite.
  ComponentValues errors(double safety = 1) const;
  // The largest of them, relative to the size of its component.
  double relative_error(double safety = 1) const;

 private:
  struct Difference {
    ComponentValues of_components;
    double relative;
  };
  double expected_;
  std::vector<Difference> differences_;
};

// The reported error is the estimate times this factor, since the errors of kinks between nodes vary from one grid to
// the next. Measured: the true error was up to 2.04 times the estimate on tests/cases and the examples of the papers
// with 64 to 262144 steps, and 11 times on one of 293 random systems (tests/core/driver/error_figure_test.cc, other
// seeds).
inline constexpr double kSafety = 5;
// The same for EstimateError(), which compares three grids of given steps. Smaller, since this figure is information
// and not a promise.
inline constexpr double kSafetyOfComparison = 3;

struct StepControl {
  const Options& options;  // for the tolerances
  double expected_order = 2;
  Index most_steps = 0;      // of a trial
  Index most_steps_all = 0;  // of all trials together; 0 for any number
  // All nodes of grids up to this many steps are output nodes; of finer grids only the same nodes.
  Index nodes_kept = 0;
  bool whole_horizon = false;  // the method iterates over all of [0, T]: if that diverges, shorter steps do not help
};

// How far the data are changed, in ulps, for the solve with differently rounded data
// (core/event_driven/rounded_data.h), whose difference is the rounding of a solution. More than one ulp, since it is a
// random sample.
inline constexpr double kRoundedUlps = 4;

// What changes of the data make of a solution, but at least the rounding of the rows that y and w are computed from: a
// sample may show less.
ComponentValues WithRoundingOfRows(ComponentValues of_data, const ComponentValues& of_terms);

struct TrialSolves {
  std::function<absl::StatusOr<Solution>(const Grid&)> solve;
  // Solves with the data changed by so many ulps; empty for problems without that test.
  std::function<absl::StatusOr<Solution>(const Grid&, double ulps)> solve_rounded = {};
  // The sizes of the components whose errors are estimated, and what is rounding of them if data are not changed.
  std::function<ComponentValues(const Solution&)> sizes;
  std::function<ComponentValues(const ComponentValues& sizes)> rounding_of_terms;
  std::function<ComponentValues(const Solution& coarse, const Solution& fine, const ComponentValues& sizes)> compare;
  // Returns the changes of x within the steps that pairs switch in; see SwitchChanges(). Empty if that is not known.
  std::function<ComponentValues(const Solution&, const ComponentValues& sizes)> at_switches = {};
  // Raises the errors of y and w to what those of x make of them; see RaiseToEffectOfStates().
  std::function<void(const Solution&, TrajectoryErrors&)> follow_states = [](const Solution&, TrajectoryErrors&) {};
  // What a solve on the grid does not see of f and g.
  std::function<Unresolved(const Grid&, const Solution&)> unresolved = [](const Grid&, const Solution&) {
    return Unresolved();
  };
  std::function<bool(const Grid&)> fits;  // whether a solve fits into the allowed memory
};

struct ControlledSolution {
  Solution solution;                 // of the finest trial; the errors of its accuracy are set
  Grid grid = {};                    // of the finest trial
  std::optional<double> order = {};  // the observed one; none before it shows, or where trials are the same
  bool converges = false;            // the solves have shown so; otherwise no tolerance can be reached
  bool reached = false;              // truncation is as small as the tolerances require (ExcessOfTruncation())
};

// Solves on `grid` and on grids with half the step, a quarter and so on, until the error of the finest is below the
// tolerance. The steps of `grid` must be short enough for the method to converge, not for the tolerance. Its nodes are
// output nodes of every trial.
//
// The error is estimated from the differences of consecutive trials at all output nodes of the coarser one, with the
// observed order. If a trial fails, its step is taken to be too long: the next one has half of it, up to
// kMaxFailingSteps. The error is at least the part of f and g that the steps do not see. Failures that do not depend on
// the step are returned at once, as are Cancelled and errors. The trials end without success if the next one would have
// more steps than `control` allows or would not fit into memory, or if even a second-order method would need a hundred
// times as many steps. What rounding of the data does is measured at the first trial, and at the first one whose error
// is below 1e-3.
//
// Grids with halved steps may place a switch alike and agree on a wrong answer. If that may matter (`at_switches`), a
// solution that meets the tolerance is also compared with one of steps three times as long.
//
// Cost: twice that of the last trial, and a third of it for each such comparison. Memory: the trajectories of two
// trials, of three during a test.
absl::StatusOr<ControlledSolution> SolveToTolerance(const StepControl& control, Grid grid, const TrialSolves& trials);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_STEP_CONTROL_H_
