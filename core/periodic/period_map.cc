// SPDX-License-Identifier: Apache-2.0
#include "core/periodic/period_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/context/sizes.h"
#include "core/discretization/grid.h"
#include "core/discretization/legendre.h"
#include "core/driver/step_control.h"
#include "core/event_driven/mode_sizes.h"
#include "core/event_driven/rounded_data.h"

namespace dlcs {
namespace {

// The size of a state is at least this part of its size in the first solve, and of what the other states contribute to
// it in a period. A state that comes to rest at zero has no relative accuracy. Later solves do not show sizes: those of
// an unstable system grow without bounds, and Newton's method may wander far away. The first part is far from both
// rounding and what counts, by four digits or more; by the second one, the error that is allowed to a state which is
// small by cancellation is that of three more digits of its terms.
constexpr double kOfFirst = 1e-10;
constexpr double kOfOthers = 1e-3;

// ∫ P_k ds from -1 to `s`, for all k.
LegendreVector IntegralsTo(double s) {
  const LegendreVector values = LegendreValues(s);
  LegendreVector integrals;
  integrals[0] = s + 1;
  for (Index k = 1; k < kLegendreSize; ++k) {
    // P_{k+1} by the recurrence of three terms: (k + 1) P_{k+1} = (2k + 1) s P_k - k P_{k-1}.
    const auto order = static_cast<double>(k);
    const double next = ((2 * order + 1) * s * values[k] - order * values[k - 1]) / (order + 1);
    integrals[k] = (next - values[k - 1]) / (2 * order + 1);
  }
  return integrals;
}

// The part of a piece in use, as a position on it.
double EndOf(const TrajectoryPiece& piece) { return std::min(1.0, 2 * (piece.end - piece.begin) / piece.length - 1); }

LegendreVector ValuesAt(const TrajectoryPiece& piece, double time) {
  return LegendreValues(std::clamp(2 * (time - piece.begin) / piece.length - 1, -1.0, 1.0));
}

void SetRanges(PeriodSolve& solve) {
  Vector low = solve.start.cwiseMin(solve.end), high = solve.start.cwiseMax(solve.end);
  LegendreRows values;
  for (const TrajectoryPiece& piece : solve.solution.pieces) {
    const auto inside = (EndOf(piece) + 1) / 2 * (GetLegendreBasis().nodes.array() + 1) - 1;
    LegendreValuesAt(inside.matrix(), values);
    const Matrix x = piece.x * values.leftCols(piece.x.cols()).transpose();
    low = low.cwiseMin(x.rowwise().minCoeff());
    high = high.cwiseMax(x.rowwise().maxCoeff());
  }
  solve.own = low.cwiseAbs().cwiseMax(high.cwiseAbs());
  solve.range = high - low;
}

// The branch on which the period ends, for the rule history.
void SetBranch(const Vector& y_before, PeriodSolve& solve) {
  solve.y_before = y_before;
  const TrajectoryPiece& last = solve.solution.pieces.back();
  solve.y_end = BranchAt(last, last.end);
  solve.y_size = solve.y_end;
  LegendreRows values;
  for (const TrajectoryPiece& piece : solve.solution.pieces) {
    const auto inside = (EndOf(piece) + 1) / 2 * (GetLegendreBasis().nodes.array() + 1) - 1;
    LegendreValuesAt(inside.matrix(), values);
    const Matrix y = piece.y * values.leftCols(piece.y.cols()).transpose();
    solve.y_size = solve.y_size.cwiseMax(y.rowwise().maxCoeff());
  }
}

// `first`: each state in the first solve.
void RaiseSizes(const Vector& first, PeriodSolve& solve) {
  solve.size = solve.own.cwiseMax(kOfFirst * first);
  if (solve.has_derivative()) {
    const Matrix moves = solve.flow().derivative.cwiseAbs() * solve.size.asDiagonal();
    solve.size = solve.size.cwiseMax(kOfOthers * moves.rowwise().maxCoeff());
  }
  for (double& size : solve.size) {
    if (size == 0) size = 1;  // nothing moves it
  }
}

}  // namespace

bool PeriodSolve::IsOnBranch(const Vector& y) const {
  static constexpr double kPositive = 1e-3, kZero = 1e-9;
  if (y_size.size() == 0) return true;
  if (y_before.size() == 0) return false;
  const auto differ = [this](const Vector& one, const Vector& other) {
    const Vector unit = y_size.cwiseMax(std::numeric_limits<double>::min() / kZero);
    return (one.array() > kPositive * unit.array() && other.array() <= kZero * unit.array()).any();
  };
  return !differ(y, y_before) && !differ(y_before, y);
}

PeriodMap::PeriodMap(const Problem& problem, const Options& options, Plan plan, Observer& observer,
                     std::stop_token stop)
    : problem_(problem),
      options_(options),
      plan_(std::move(plan)),
      observer_(observer, problem.horizon),
      stop_(std::move(stop)),
      started_(std::chrono::steady_clock::now()),
      first_(problem.x0.cwiseAbs()) {
  options_.period = 0;
  options_.keep_pieces = true;
  options_.keep_flow = true;
  // An iterate need not be consistent where the periodic solution is.
  options_.project_initial_state = true;
}

absl::StatusOr<PeriodSolve> PeriodMap::Solve(const Vector& start, const Vector& y_before, double period,
                                             double tolerance, bool as_asked) {
  Options options = options_;
  options.error_tolerance = tolerance;
  if (!as_asked) {
    options.num_steps = 1;
    options.step = 0;
    options.grid_times.clear();
    options.output_times.clear();
  }
  problem_.x0 = start;
  if (y_before.size() > 0) problem_.y0 = y_before;
  problem_.horizon = period;
  const Grid grid = MakeGrid(period, BreakPoints(problem_), options);
  Task task{.problem = problem_,
            .options = options,
            .plan = plan_,
            .workers = Workers(options.num_threads),
            .stop = stop_,
            .started = started_};
  observer_.NextTrial();
  auto solution = SolveOnGrid(task, grid, observer_);
  if (!solution.ok()) return solution.status();
  const bool is_first = solves_ == 0;
  solves_ += solution->cost.solves;
  if (solution->flow) work_ += solution->flow->work;
  PeriodSolve solve{.start = start, .period = period, .solution = *std::move(solution)};
  const Solution& result = solve.solution;
  solve.reached = result.termination == Termination::kReachedEnd && !result.pieces.empty() && result.flow;
  if (!solve.reached) return solve;
  const TrajectoryPiece& last = result.pieces.back();
  solve.end = last.x * LegendreValues(EndOf(last)).head(last.x.cols());
  SetRanges(solve);
  if (problem_.rule == SolutionRule::kHistory) SetBranch(problem_.y0.value_or(Vector()), solve);
  if (is_first) first_ = first_.cwiseMax(solve.own);
  RaiseSizes(first_, solve);
  const ErrorsByCause& errors = result.accuracy.errors.x;
  // Of what is rounding its own size says nothing.
  std::optional<Vector> beside;
  for (Index i = 0; i < errors.size(); ++i) {
    if (!IsRounding(errors, i)) continue;
    if (!beside) beside = SizesBesideOf(problem_, plan_.selection, result).of(ComponentKind::kState).size;
    solve.size[i] = std::max(solve.size[i], (*beside)[i]);
  }
  solve.error = (errors.truncation + errors.rounding).cwiseQuotient(solve.size);
  return solve;
}

absl::StatusOr<PeriodSolve> PeriodMap::SolveOtherwise(const PeriodSolve& solve, const Vector& start, double tolerance) {
  const Problem exact = problem_;
  problem_ = WithFasterRates(exact, kRoundedUlps);
  auto other = Solve(start, solve.y_end, solve.period, 2 * tolerance, /*as_asked=*/false);
  problem_ = exact;
  return other;
}

Vector StateAt(const TrajectoryPiece& piece, double time) {
  return piece.x * ValuesAt(piece, time).head(piece.x.cols());
}

Vector BranchAt(const TrajectoryPiece& piece, double time) {
  const LegendreVector values = ValuesAt(piece, time);
  const Vector y = piece.y * values.head(piece.y.cols()), w = piece.w * values.head(piece.w.cols());
  return (w.array() == 0).select(y.cwiseMax(std::numeric_limits<double>::min()), 0);
}

const TrajectoryPiece& PieceAt(const Solution& solution, double time) {
  const auto ends_before = [](const TrajectoryPiece& piece, double t) { return piece.end < t; };
  const auto piece = std::lower_bound(solution.pieces.begin(), solution.pieces.end(), time, ends_before);
  return piece == solution.pieces.end() ? solution.pieces.back() : *piece;
}

std::vector<std::complex<double>> MultipliersOf(const Matrix& matrix) {
  if (matrix.size() == 0 || !matrix.allFinite()) return {};
  const Eigen::VectorXcd found = matrix.eigenvalues();
  std::vector<std::complex<double>> multipliers(found.begin(), found.end());
  // Of a pair the one above the real axis first.
  std::stable_sort(multipliers.begin(), multipliers.end(), [](const auto& a, const auto& b) {
    if (std::abs(a) != std::abs(b)) return std::abs(a) > std::abs(b);
    return a.imag() > b.imag();
  });
  return multipliers;
}

void SetAverages(const Solution& solution, PeriodicRecord& record) {
  double length = 0;
  for (const TrajectoryPiece& piece : solution.pieces) {
    const LegendreVector integrals = piece.length / 2 * IntegralsTo(EndOf(piece));
    const auto add = [&](const Matrix& series, Vector& sum) {
      if (sum.size() == 0) sum = Vector::Zero(series.rows());
      sum += series * integrals.head(series.cols());
    };
    add(piece.x, record.mean_x);
    add(piece.y, record.mean_y);
    add(piece.w, record.mean_w);
    length += piece.end - piece.begin;
  }
  if (!(length > 0)) return;
  for (Vector* mean : {&record.mean_x, &record.mean_y, &record.mean_w}) *mean /= length;
}

}  // namespace dlcs
