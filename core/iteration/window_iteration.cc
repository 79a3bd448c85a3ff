// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/window_iteration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>
#include <vector>

#include "core/iteration/anderson.h"
#include "core/iteration/jump_test.h"
#include "core/iteration/window_control.h"
#include "core/laplace/iteration_bounds.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/norms.h"
#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {
namespace {

// The bound of change k in terms of the first: the discrete kernel is at most κ h per step, so with the rate L κ h
// |q^{k} - q^{k-1}|_j <= (L κ h)^{k-1} C(j + k - 2, k - 1) |q^1 - q^0|, which tends to (L κ t)^{k-1}/(k-1)!.
double LogBound(double rate, Index steps, Index k, double first_change) {
  if (std::isnan(rate)) return rate;
  return LogReducedFactor(rate, static_cast<double>(steps), static_cast<int>(k - 1)) + std::log(first_change);
}

// q of x^0: y frozen at its start, or at the end of `guess`, which comes first.
Matrix FirstIterate(const Matrix& guess, WindowModel& window) {
  Matrix q = window.Frozen();
  if (guess.cols() == 0) return q;
  const Index known = std::min(guess.cols(), window.steps());
  window.y.middleCols(1, known) = guess.leftCols(known);
  window.y.rightCols(window.steps() - known).colwise() = guess.col(known - 1);
  window.Follow(q);
  return q;
}

// Windows in flight that grow beyond this would drown the first one in the rounding of the convolution.
bool IsTame(const Matrix& next, const Matrix& q, const Vector& size) {
  // The rounding of 1e3 is a tenth of the tolerance for iterates, 1e-12, and a factor of 4 leaves it below.
  constexpr double kMaxGrowth = 1e3;
  return RelativeChange(size, RowMaxAbs(next - q)) <= kMaxGrowth;
}

struct Columns {
  Index rows;
  const double *q, *next, *y, *M_y;
};

// Raises for each row the change, the size of `next` and, unless null, |min(y, next + M y)|.
void Compare(const Columns& columns, double* changes, double* sizes, double* residuals) {
  RunWide([=]() DLCS_WIDE {
    const double* __restrict q = columns.q, * __restrict next = columns.next;
    double* __restrict change = changes, * __restrict size = sizes;
    for (Index i = 0; i < columns.rows; ++i) {
      change[i] = NanMax(change[i], std::abs(next[i] - q[i]));
      size[i] = NanMax(size[i], std::abs(next[i]));
    }
  });
  if (!residuals) return;
  RunWide([=]() DLCS_WIDE {
    const double* __restrict next = columns.next, * __restrict y = columns.y, * __restrict M_y = columns.M_y;
    double* __restrict residual = residuals;
    for (Index i = 0; i < columns.rows; ++i) {
      const double w = M_y[i] + next[i];
      residual[i] = NanMax(residual[i], std::abs(y[i] < w || y[i] != y[i] ? y[i] : w));
    }
  });
}

}  // namespace

WindowIteration::WindowIteration(SolveContext& context, bool may_shrink)
    : context_(context), problem_(context.problem), may_shrink_(may_shrink), batch_(problem_.M, context.choice()) {}

Index WindowIteration::max_iterations() const {
  if (context_.options.max_iterations > 0) return context_.options.max_iterations;
  return may_shrink_ ? kMaxIterationsOfShrinking : kMaxIterationsOfFixed;
}

WindowResult WindowIteration::Run(Index number, WindowModel& window, const Flight& flight) {
  const Vector y_start = window.y.col(0);
  Matrix q = FirstIterate(flight.guess, window);
  if (!q.allFinite()) return {WindowEnd::kDiverged, 0, "the state is not finite"};
  WindowResult result = Iterate(number, window, flight.steps, std::move(q));
  if (result.end == WindowEnd::kInfeasibleIterate && result.iterations == 1) {
    // Theorem 3.2 of [Wu & Chen] has feasible iterates from the constant start, on windows short enough.
    window.y = y_start.replicate(1, window.steps() + 1);
    result = Iterate(number, window, flight.steps, window.Constant());
  }
  if (result.end == WindowEnd::kConverged && flight.steps == window.steps()) window.Finish();
  return result;
}

WindowResult WindowIteration::Iterate(Index number, WindowModel& window, Index first, Matrix q) {
  Index k = 0;
  const auto ended = [&k](WindowEnd end, std::string why = {}) { return WindowResult{end, k, std::move(why)}; };
  const bool is_accelerated = context_.options.acceleration > 0;
  const double not_known = std::numeric_limits<double>::quiet_NaN();
  const double rate =
      is_accelerated ? not_known : context_.matrix_class.lipschitz.value_or(not_known) * window.KernelBound();
  AndersonAcceleration acceleration(context_.options.acceleration, context_.workers);
  const Vector size_of_terms = window.Sizes();
  Vector size = size_of_terms;
  bool confirms = false;  // q is the image of an accelerated iterate that seemed to have converged
  Matrix next;
  std::vector<double> changes;  // relative to the size of each row
  double first_change = 0;
  if (context_.stop.stop_requested())
    return ended(WindowEnd::kCancelled);  // perhaps with a kernel shorter than the window

  while (k < max_iterations()) {
    ++k;
    // y^k at every node: 0 <= y ⟂ q^{k-1} + M y >= 0.
    const LcpBatchOutcome lcps = SolveLcps(q, size, window);
    if (lcps.cancelled) return ended(WindowEnd::kCancelled);
    if (lcps.verdict != LcpStatus::kSolved) {
      if (lcps.column >= first) return ended(WindowEnd::kFlightFailed);
      const double t = context_.grid.times[window.first_node() + 1 + lcps.column];
      return ended(WindowEnd::kInfeasibleIterate, "the LCP of iterate " + std::to_string(k) + " at t = " +
                                                      FormatNumber(t) + " ended as " + LcpStatusName(lcps.verdict));
    }
    if (auto jump = FindJump(q, window)) return ended(WindowEnd::kJump, *std::move(jump));

    // q^k = N x^k + g, where x^k follows from y^k by the inverse Laplace transform.
    const Judgment seen = FollowAndJudge(q, window, first, next);
    if (first < window.steps() && !IsTame(next, q, size)) return ended(WindowEnd::kFlightFailed);
    size = size_of_terms.cwiseMax(seen.row_size);  // not of earlier iterates, which may have been far larger
    changes.push_back(RelativeChange(size, seen.row_change));
    const double tolerance = context_.options.iteration_tolerance;
    const bool seems_converged = Converged(changes, tolerance) || (confirms && changes.back() <= tolerance);
    const bool has_converged = seems_converged && (!is_accelerated || confirms);
    // An error of early columns that is small beside the late ones grows into these by a plain iteration. An
    // accelerated one may hide it.
    confirms = seems_converged;
    if (!seems_converged) acceleration.Accelerate(q, size, next);
    q.swap(next);

    if (k == 1) first_change = MaxAbs(seen.row_change);
    IterateReport report;
    report.window = number, report.iteration = k;
    report.change = MaxAbs(seen.row_change), report.lcp_residual = seen.residual;
    Report(report, LogBound(rate, first, k, first_change), window, first + 1);

    if (has_converged) return ended(WindowEnd::kConverged);
    if (!std::isfinite(changes.back()) || (may_shrink_ && Diverging(changes))) {
      return ended(WindowEnd::kDiverged,
                   "the iterates diverge (N x + g changed by " + FormatNumber(changes.back()) + " of its size)");
    }
  }
  return ended(WindowEnd::kIterationLimit,
               "the change of N x + g is still " + FormatNumber(changes.back()) + " of its size");
}

LcpBatchOutcome WindowIteration::SolveLcps(const Matrix& q, const Vector& size, WindowModel& window) {
  Cost& cost = context_.solution.cost;
  const double begin = context_.Seconds();
  const Index steps = window.steps();
  const LcpBatchOutcome outcome = batch_.Solve(q.rightCols(steps), kLcpTolerance * size, context_.workers,
                                               context_.stop, window.y.rightCols(steps));
  ++cost.iterations;
  cost.lcps += steps;
  cost.seconds_lcp += context_.Seconds() - begin;
  return outcome;
}

WindowIteration::Judgment WindowIteration::FollowAndJudge(const Matrix& q, WindowModel& window, Index first,
                                                          Matrix& next) {
  const double begin = context_.Seconds();
  Judgment seen{Vector::Zero(q.rows()), Vector::Zero(q.rows())};
  std::mutex mutex;
  window.Follow(next, [&](Index block_begin, Index block_end) {
    if (block_begin > first) return;  // in a later window
    const Judgment of_block = Judge(q, next, window.y, block_begin, std::min(block_end, first + 1));
    const std::lock_guard lock(mutex);
    seen.Raise(of_block);
  });
  context_.solution.cost.seconds_linear += context_.Seconds() - begin;
  return seen;
}

void WindowIteration::Judgment::Raise(const Judgment& other) {
  RaiseRowMaxAbs(other.row_change, row_change);
  RaiseRowMaxAbs(other.row_size, row_size);
  residual = NanMax(residual, other.residual);
}

WindowIteration::Judgment WindowIteration::Judge(const Matrix& q, const Matrix& next, const Matrix& y, Index begin,
                                                 Index end) const {
  const Index n = q.rows(), count = end - begin;
  Judgment seen{Vector::Zero(n), Vector::Zero(n)};
  Matrix w(n, count);
  problem_.M.Multiply(y.middleCols(begin, count), w);
  Vector residuals = Vector::Zero(n);
  for (Index j = 0; j < count; ++j) {
    const Columns columns{n, q.col(begin + j).data(), next.col(begin + j).data(), y.col(begin + j).data(),
                          w.col(j).data()};
    Compare(columns, seen.row_change.data(), seen.row_size.data(), begin + j > 0 ? residuals.data() : nullptr);
  }
  seen.residual = MaxAbs(residuals);
  return seen;
}

// If y need not be a Lipschitz function: the first step over which y of an iterate changes by more than any piece of
// the function allows.
std::optional<std::string> WindowIteration::FindJump(const Matrix& q, const WindowModel& window) const {
  if (!context_.choices.largest_slope) return std::nullopt;
  const auto jump = DetectJump(q, window.y, *context_.choices.largest_slope);
  if (!jump) return std::nullopt;
  return DescribeJump(*jump, context_.grid.times[window.first_node() + jump->column], *context_.choices.largest_slope);
}

void WindowIteration::Report(IterateReport report, double log_bound, const WindowModel& window, Index columns) {
  report.seconds = context_.Seconds();
  if (std::isfinite(log_bound)) report.log10_bound = log_bound / std::log(10.0);
  const auto times = std::span(context_.grid.times).subspan(static_cast<size_t>(window.first_node()));
  context_.observer.OnIterate(report, {times.first(static_cast<size_t>(columns)), window.y.leftCols(columns)});
}

}  // namespace dlcs
