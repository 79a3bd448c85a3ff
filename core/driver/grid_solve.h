// SPDX-License-Identifier: Apache-2.0
// One solve on one grid, as planned.

#ifndef DLCS_CORE_DRIVER_GRID_SOLVE_H_
#define DLCS_CORE_DRIVER_GRID_SOLVE_H_

#include <chrono>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "core/discretization/grid.h"
#include "core/driver/plan.h"
#include "core/parallel/parallel.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

inline double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// "1 step", "20 steps"
inline std::string StepsText(Index steps) { return std::to_string(steps) + (steps == 1 ? " step" : " steps"); }

// The inputs that solves on several grids share.
struct Task {
  const Problem& problem;
  Options options;
  Plan plan;
  Workers workers;
  std::stop_token stop;
  std::chrono::steady_clock::time_point started;
  SetupCache* setups = nullptr;         // may be null
  const ResumePoint* resume = nullptr;  // may be null; where the first solve resumes
  bool leaves_checkpoints = false;      // no second solve may replace this one
  bool error_by_default = false;        // options.error_tolerance was filled in: FillInDefaultError()
  bool follows_event_driven = false;    // event_driven was tried before and has used its share of the default work
  bool lost_least_element = false;      // set by the last solve: see SolveContext
  Cost stages = {};                     // the stages of all solves so far
};

// Solves with the method and propagator of task.plan, from `resume` on if it is given. Times of stages are those of all
// solves of the task so far. Errors: InvalidArgument if a source cannot be evaluated, or if `resume` does not belong to
// this solve.
absl::StatusOr<Solution> SolveOnGrid(Task& task, const Grid& grid, Observer& observer,
                                     const ResumePoint* resume = nullptr);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_GRID_SOLVE_H_
