// SPDX-License-Identifier: Apache-2.0
// The map from x(0) to x(period), with its derivative.

#ifndef DLCS_CORE_PERIODIC_PERIOD_MAP_H_
#define DLCS_CORE_PERIODIC_PERIOD_MAP_H_

#include <chrono>
#include <complex>
#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "core/driver/error_control.h"
#include "core/driver/plan.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// A solve over one period.
struct PeriodSolve {
  Vector start;  // before a jump at 0
  double period = 0;
  Solution solution = {};  // with pieces and flow
  bool reached = false;    // the end, with whatever error
  Vector end = {};         // x(period⁻)
  Vector own = {};         // max |x_i|
  Vector size = {};        // the same, or a scale for a state that rests at zero
  Vector range = {};       // max x_i - min x_i
  Vector error = {};       // of each x_i, estimated, relative to its size
  // With the rule history, where x alone does not determine y; empty otherwise.
  Vector y_before = {};  // before 0, which chose the first solution
  Vector y_end = {};     // y(period⁻)
  Vector y_size = {};    // max |y_i|

  const FlowRecord& flow() const { return *solution.flow; }
  bool has_derivative() const { return flow().derivative.size() > 0; }
  // Whether `y` is positive where that before 0 was, so that the next period would repeat this one.
  bool IsOnBranch(const Vector& y) const;
};

class PeriodMap {
 public:
  // Keeps references; `plan` is for `problem`, whose horizon is the first period.
  PeriodMap(const Problem& problem, const Options& options, Plan plan, Observer& observer, std::stop_token stop);

  // Solves on [0, period] from `start`, which may jump to a consistent state. With the rule history, the solution
  // continues that with `y_before`, or starts as the problem says where that is empty. The nodes are those of the
  // options with `as_asked`, and 0 and the period otherwise. Errors: as SolveOnGrid().
  absl::StatusOr<PeriodSolve> Solve(const Vector& start, const Vector& y_before, double period, double tolerance,
                                    bool as_asked);

  // Solves the period after `solve` from `start`, near its end, with rates that are some ulps faster, and with steps
  // that err twice as much if `tolerance` was that of `solve`: so both differ by the errors of `solve`.
  absl::StatusOr<PeriodSolve> SolveOtherwise(const PeriodSolve& solve, const Vector& start, double tolerance);

  // The number of solves, with those that event_driven repeated, and their work.
  Index solves() const { return solves_; }
  Index work() const { return work_; }
  const Plan& plan() const { return plan_; }
  // With the start and the period of the last solve.
  const Problem& problem() const { return problem_; }

 private:
  Problem problem_;
  Options options_;
  Plan plan_;
  TrialObserver observer_;
  std::stop_token stop_;
  std::chrono::steady_clock::time_point started_;
  Vector first_;  // |x_i| in the first solve
  Index solves_ = 0;
  Index work_ = 0;
};

// x of a piece at `time`.
Vector StateAt(const TrajectoryPiece& piece, double time);
// y of a piece at `time`, which is positive, if only just, where the pair is active: what Problem::y0 takes.
Vector BranchAt(const TrajectoryPiece& piece, double time);

// The piece of `solution` at `time`.
const TrajectoryPiece& PieceAt(const Solution& solution, double time);

// The eigenvalues of `matrix`, the largest first.
std::vector<std::complex<double>> MultipliersOf(const Matrix& matrix);

// The averages of x, y and w over the pieces of `solution`, exact for their polynomials.
void SetAverages(const Solution& solution, PeriodicRecord& record);

}  // namespace dlcs

#endif  // DLCS_CORE_PERIODIC_PERIOD_MAP_H_
