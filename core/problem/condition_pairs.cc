// SPDX-License-Identifier: Apache-2.0
#include "core/problem/condition_pairs.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/format_number.h"
#include "core/problem/time_axis.h"

namespace dlcs {
namespace {

Matrix Below(const Matrix& matrix, const Matrix& rows) {
  Matrix both(matrix.rows() + rows.rows(), rows.cols());
  both << matrix, rows;
  return both;
}

// The piece with constant components behind its own.
TimePiece WithConstants(const TimePiece& piece, const Vector& constants) {
  struct Append {
    const Vector& constants;
    TimePiece operator()(ConstantFunction of) const {
      const Vector own = of.value;
      of.value.resize(own.size() + constants.size());
      of.value << own, constants;
      return of;
    }
    TimePiece operator()(FormulaFunction of) const {
      for (const double value : constants) of.formulas.push_back(NumberText(value));
      return of;
    }
    TimePiece operator()(SampledFunction of) const {
      of.values = Below(of.values, constants.replicate(1, of.values.cols()));
      return of;
    }
    TimePiece operator()(PiecewisePolynomial of) const {
      for (Matrix& coefficients : of.coefficients) {
        Matrix rows = Matrix::Zero(constants.size(), coefficients.cols());
        rows.col(0) = constants;
        coefficients = Below(coefficients, rows);
      }
      return of;
    }
  };
  return std::visit(Append{constants}, piece);
}

TimeFunction WithConstants(TimeFunction function, Index size, const Vector& constants) {
  if (function.is_lifted()) {
    const Index inner = function.lift.cols(), count = constants.size();
    Matrix lift = Matrix::Zero(size + count, inner + count);
    lift.topLeftCorner(size, inner) = function.lift.Dense();
    lift.bottomRightCorner(count, count).setIdentity();
    function.lift = lift;
  }
  for (TimeFunction::Piece& piece : function.pieces) piece.function = WithConstants(piece.function, constants);
  return function;
}

}  // namespace

std::vector<double> KnownTimesOf(const Problem& problem) {
  std::vector<double> times;
  for (const Switch& of : problem.switching.switches) {
    times.insert(times.end(), of.edges.begin(), of.edges.end());
    times.insert(times.end(), of.clock.begin(), of.clock.end());
  }
  for (const StateReset& reset : problem.switching.resets) {
    times.insert(times.end(), reset.times.begin(), reset.times.end());
  }
  return MergeBreakPoints({}, times, problem.horizon);
}

Problem WithConditionPairs(const Problem& problem) {
  const Switching& switching = problem.switching;
  const std::vector<SwitchCondition> conditions = ConditionsOf(switching);
  const Index m = problem.num_states(), n = problem.num_constraints(), count = static_cast<Index>(conditions.size());
  Problem extended = problem;
  extended.break_points = MergeBreakPoints(problem.break_points, KnownTimesOf(problem), problem.horizon);
  if (n + count == 0) {  // no solve is without pairs: 0 <= y ⟂ y + 1 >= 0
    extended.B = Matrix::Zero(m, 1);
    extended.N = Matrix::Zero(1, m);
    extended.M = Matrix::Identity(1, 1);
    extended.g = TimeFunction::Constant(Vector::Ones(1));
    return extended;
  }
  Matrix B = Matrix::Zero(m, n + count), N = Matrix::Zero(n + count, m), M = Matrix::Zero(n + count, n + count);
  if (n > 0) {
    B.leftCols(n) = problem.B.Dense();
    N.topRows(n) = problem.N.Dense();
    M.topLeftCorner(n, n) = problem.M.Dense();
  }
  M.bottomRightCorner(count, count).setIdentity();
  Vector levels(count);
  for (Index k = 0; k < count; ++k) {
    const SwitchCondition& condition = conditions[static_cast<std::size_t>(k)];
    const double sign = condition.is_below ? 1 : -1;
    if (switching.C.size() > 0) N.row(n + k) = sign * switching.C.row(condition.control);
    if (switching.D.size() > 0) M.row(n + k).head(n) = sign * switching.D.row(condition.control);
    const double h = switching.h.size() > 0 ? switching.h[condition.control] : 0;
    levels[k] = sign * (h - condition.level);
  }
  extended.B = B;
  extended.N = N;
  extended.M = M;
  extended.g = n > 0 ? WithConstants(problem.g, n, levels) : TimeFunction::Constant(levels);
  if (problem.outputs.size() > 0) {
    Matrix D = Matrix::Zero(problem.outputs.size(), n + count);
    if (n > 0) D.leftCols(n) = problem.outputs.D.Dense();
    extended.outputs.D = D;
  }
  return extended;
}

void RemoveConditionPairs(Index n, Solution& solution) {
  const auto cut = [n](auto& rows) { rows = rows.topRows(std::min(n, rows.rows())).eval(); };
  cut(solution.y);
  cut(solution.w);
  for (LeftLimit& limit : solution.left_limits) {
    cut(limit.y);
    cut(limit.w);
  }
  for (TrajectoryPiece& piece : solution.pieces) {
    cut(piece.y);
    cut(piece.w);
  }
  for (StateJump& jump : solution.jumps) cut(jump.multiplier);
  cut(solution.largest.y);
  cut(solution.largest.w);
  for (ErrorsByCause* of : {&solution.accuracy.errors.y, &solution.accuracy.errors.w}) {
    cut(of->own);
    cut(of->truncation);
    cut(of->rounding);
  }
  std::erase_if(solution.accuracy.named, [n](const NamedComponent& named) {
    const ComponentKind kind = named.component.kind;
    return (kind == ComponentKind::kPair || kind == ComponentKind::kSlack) && named.component.index >= n;
  });
  for (SwitchingTime& time : solution.switching_times) {
    for (std::vector<Index>* pairs : {&time.entering, &time.leaving}) {
      std::erase_if(*pairs, [n](Index pair) { return pair >= n; });
    }
  }
  std::erase_if(solution.switching_times, [](const SwitchingTime& time) {
    return time.kind == SwitchingKind::kSwitch && time.entering.empty() && time.leaving.empty();
  });
}

}  // namespace dlcs
