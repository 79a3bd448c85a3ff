// SPDX-License-Identifier: Apache-2.0
// Compares solves with steps of different lengths, for any kind of problem.

#ifndef DLCS_CORE_DRIVER_STEP_COMPARISON_H_
#define DLCS_CORE_DRIVER_STEP_COMPARISON_H_

#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/context/component_errors.h"
#include "core/discretization/grid.h"
#include "core/driver/step_control.h"
#include "core/problem/options.h"
#include "core/problem/solution.h"

namespace dlcs {

// All nodes of grids up to this many steps are compared; of finer grids only the same nodes.
inline constexpr Index kNodesKept = 4096;
// Of solves that form the states only at output nodes, which costs as much as many steps: an estimate costs no more
// than its solve.
inline constexpr Index kFormedNodesKept = 16;

// The solves that EstimateError() and SolveAsAsked() are made of, for any kind of problem.
struct SystemSolves {
  double horizon = 0;
  std::vector<double> break_points;
  double expected_order = 2;
  bool event_driven_serves = true;  // it may be recommended
  Index nodes_compared = kNodesKept;  // of the solves that CompareSteps() adds
  TrialSolves trials;
  // Returns the grid of the first trial for a grid of equal steps; empty if that is the same.
  std::function<Grid(const Grid&)> grade = {};
  // Of all trials together, if the error tolerance is the default one.
  Index most_default_steps = Options::kMaxDefaultSteps;
};

// Estimates the error of `solution` on `grid` by solves with twice and four times the step; with half the step if one
// of those fails or their differences show no order.
absl::Status CompareSteps(const SystemSolves& system, const Grid& grid, Solution& solution);

// Sets note and message of `solution` after the trials. `by_default`: the tolerance was the default one.
void ConcludeTrials(const SystemSolves& system, const ControlledSolution& result, const Options& options,
                    bool by_default, Solution& solution);

// Runs trials with more and more steps until the error is below options.error_tolerance. `by_default`: the tolerance is
// the default one, and the work is bounded.
absl::StatusOr<ControlledSolution> TrySteps(const SystemSolves& system, Options options, Index most_steps,
                                            bool by_default, std::vector<double>& wanted);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_STEP_COMPARISON_H_
