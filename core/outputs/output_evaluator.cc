// SPDX-License-Identifier: Apache-2.0
#include "core/outputs/output_evaluator.h"

#include <algorithm>
#include <string>
#include <utility>
#include <variant>

namespace dlcs {
namespace {

// x before the jumps at the time of `column`.
Vector StateBefore(const Solution& solution, Index column) {
  Vector x = solution.x.col(column);
  const double time = solution.times[static_cast<std::size_t>(column)];
  auto jump = std::lower_bound(solution.jumps.begin(), solution.jumps.end(), time,
                               [](const StateJump& a, double t) { return a.time < t; });
  for (; jump != solution.jumps.end() && jump->time == time; ++jump) x -= jump->dx;
  return x;
}

// The first limit at `column` or after it.
std::vector<LeftLimit>::const_iterator LimitFrom(const Solution& solution, Index column) {
  return std::lower_bound(solution.left_limits.begin(), solution.left_limits.end(), column,
                          [](const LeftLimit& limit, Index k) { return limit.column < k; });
}

// Formulas that `function` has no use of become zero: they need no time then, and do not make it vary.
void DropUnused(TimeFunction& function) {
  const Vector uses = Vector::Ones(function.lift.rows()).transpose() * function.lift.Sparse().cwiseAbs();
  for (TimeFunction::Piece& piece : function.pieces) {
    auto* formulas = std::get_if<FormulaFunction>(&piece.function);
    if (!formulas) continue;
    for (std::size_t i = 0; i < formulas->formulas.size(); ++i) {
      if (uses[static_cast<Index>(i)] == 0) formulas->formulas[i] = "0";
    }
  }
}

}  // namespace

absl::StatusOr<OutputEvaluator> OutputEvaluator::Create(const Problem& problem) {
  TimeAxis axis = AxisOf(problem);
  auto h = TimeFunctionEvaluator::Create(problem.outputs.h, problem.outputs.size(), axis);
  if (!h.ok()) return h.status();
  const Outputs& outputs = problem.outputs;
  return OutputEvaluator(outputs.C, outputs.D, outputs.shown(), std::move(axis), *std::move(h));
}

absl::StatusOr<OutputEvaluator> OutputEvaluator::Create(const Problem& problem, const std::vector<Index>& outputs) {
  const auto count = static_cast<Index>(outputs.size());
  SparseMatrix chosen(count, problem.outputs.size());
  for (Index k = 0; k < count; ++k) chosen.insert(k, outputs[static_cast<std::size_t>(k)]) = 1;
  TimeFunction function = problem.outputs.h;
  function.lift = function.is_lifted() ? SparseMatrix(chosen * function.lift.Sparse()) : chosen;
  DropUnused(function);
  TimeAxis axis = AxisOf(problem);
  auto h = TimeFunctionEvaluator::Create(function, count, axis);
  if (!h.ok()) return h.status();
  return OutputEvaluator(SparseMatrix(chosen * problem.outputs.C.Sparse()),
                         SparseMatrix(chosen * problem.outputs.D.Sparse()), count, std::move(axis), *std::move(h));
}

OutputEvaluator::OutputEvaluator(StructuredMatrix C, StructuredMatrix D, Index shown, TimeAxis axis,
                                 TimeFunctionEvaluator h)
    : C_(std::move(C)), D_(std::move(D)), shown_(shown), axis_(std::move(axis)), h_(std::move(h)) {}

Vector OutputEvaluator::At(double t, Side side, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y) {
  Vector z(size());
  h_.Evaluate(axis_.Nearest(t), side, z);
  z += C_ * x + D_ * y;
  return z;
}

Matrix OutputEvaluator::Between(const Eigen::Ref<const Vector>& times, const Matrix& x, const Matrix& y) {
  Matrix z(size(), times.size());
  const Index last = times.size() - 1;
  if (h_.IsSteady(axis_.Nearest(times[0]), axis_.Nearest(times[last]))) {
    h_.Evaluate((times[0] + times[last]) / 2, Side::kRight, z.col(0));
    z.rightCols(last).colwise() = Vector(z.col(0));
  } else {
    for (Index j = 0; j <= last; ++j) {
      h_.Evaluate(axis_.Nearest(times[j]), j < last ? Side::kRight : Side::kLeft, z.col(j));
    }
  }
  z += C_ * x + D_ * y;
  return z;
}

std::optional<Matrix> OutputEvaluator::Polynomials(double begin, double end, const Matrix& x, const Matrix& y) {
  if (!h_.IsSteady(axis_.Nearest(begin), axis_.Nearest(end))) return std::nullopt;
  Matrix z = Matrix::Zero(size(), std::max(x.cols(), y.cols()));
  h_.Evaluate((begin + end) / 2, Side::kRight, z.col(0));
  z.leftCols(x.cols()) += C_ * x;
  z.leftCols(y.cols()) += D_ * y;
  return z;
}

Vector OutputEvaluator::TermsOf(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y) const {
  return C_.AbsTimes(x.cwiseAbs()) + D_.AbsTimes(y.cwiseAbs());
}

Vector OutputEvaluator::AtColumn(const Solution& solution, Index column) {
  const double t = solution.times[static_cast<std::size_t>(column)];
  return At(t, t < axis_.horizon ? Side::kRight : Side::kLeft, solution.x.col(column), solution.y.col(column));
}

Vector OutputEvaluator::BeforeColumn(const Solution& solution, Index column) {
  const double t = solution.times[static_cast<std::size_t>(column)];
  const auto limit = LimitFrom(solution, column);
  const bool is_given = limit != solution.left_limits.end() && limit->column == column;
  return At(t, Side::kLeft, StateBefore(solution, column), is_given ? limit->y : Vector(solution.y.col(column)));
}

Matrix OutputEvaluator::Columns(const Solution& solution, Index first, Index count) {
  Matrix z(shown_, count);
  for (Index k = 0; k < count; ++k) z.col(k) = AtColumn(solution, first + k).head(shown_);
  return z;
}

std::vector<OutputEvaluator::Limit> OutputEvaluator::LeftLimits(const Solution& solution, Index first, Index count) {
  std::vector<Limit> limits;
  auto next = LimitFrom(solution, first);
  const auto take_before = [&](Index column) {
    for (; next != solution.left_limits.end() && next->column < column; ++next) {
      limits.push_back({*next, BeforeColumn(solution, next->column).head(shown_)});
    }
  };
  // h jumps at break points only.
  const auto begin = solution.times.begin() + first, end = begin + count;
  auto at = begin;
  for (const double time : axis_.break_points) {
    at = std::lower_bound(at, end, time);
    if (at == end) break;
    const Index column = at - solution.times.begin();
    if (*at != time || column == 0 || time >= axis_.horizon) continue;
    take_before(column);
    if (next != solution.left_limits.end() && next->column == column) continue;
    Vector left = BeforeColumn(solution, column).head(shown_);
    if (left == AtColumn(solution, column).head(shown_)) continue;
    limits.push_back({{column, solution.y.col(column), solution.w.col(column)}, std::move(left)});
  }
  take_before(first + count);
  return limits;
}

}  // namespace dlcs
