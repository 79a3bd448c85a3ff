// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/interpolant.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "core/discretization/legendre.h"
#include "core/linalg/phi_functions.h"

namespace dlcs {
namespace {

Vector SourceAt(TimeFunctionEvaluator& function, double time, Side side) {
  Vector value(function.size());
  function.Evaluate(time, side, value);
  return value;
}

}  // namespace

absl::StatusOr<Interpolant> Interpolant::Create(const Problem& problem, const Solution& solution) {
  const bool dense = solution.dense_output || !solution.pieces.empty();
  if (!dense || solution.times.size() < 2) {
    return absl::InvalidArgumentError(
        "the solution has no interpolant: solve without output_times_only, without splines, and by event_driven with "
        "keep_pieces");
  }
  if (solution.x.rows() != problem.num_states() || solution.y.rows() != problem.num_constraints()) {
    return absl::InvalidArgumentError("the solution does not belong to this problem");
  }
  auto f = TimeFunctionEvaluator::Create(problem.f, problem.num_states(), AxisOf(problem));
  if (!f.ok()) return f.status();
  auto g = TimeFunctionEvaluator::Create(problem.g, problem.num_constraints());
  if (!g.ok()) return g.status();
  return Interpolant(problem, solution, *std::move(f), *std::move(g));
}

Interpolant::Interpolant(const Problem& problem, const Solution& solution, TimeFunctionEvaluator f,
                         TimeFunctionEvaluator g)
    : problem_(problem), solution_(solution), f_(std::move(f)), g_(std::move(g)) {}

Interpolant::Point Interpolant::At(double time) {
  const std::vector<double>& times = solution_.times;
  const auto node = std::lower_bound(times.begin(), times.end(), time);
  if (node == times.end() || *node != time) return Limit(time, Side::kLeft);
  const Index k = node - times.begin();
  return {solution_.x.col(k), solution_.y.col(k), solution_.w.col(k)};
}

Interpolant::Point Interpolant::Limit(double time, Side side) {
  const std::vector<double>& times = solution_.times;
  time = std::clamp(time, times.front(), times.back());
  if (!solution_.pieces.empty()) return InPiece(time, side);
  // The step that holds `time`, closed on the side that it is approached from.
  const auto end = side == Side::kLeft ? std::lower_bound(times.begin(), times.end(), time)
                                       : std::upper_bound(times.begin(), times.end(), time);
  const Index last = static_cast<Index>(times.size()) - 1;
  const Index k = std::clamp<Index>(end - times.begin() - 1, 0, last - 1);
  Point point = InStep(k, time - times[k]);
  point.w = SourceAt(g_, time, side) + problem_.N * point.x + problem_.M * point.y;
  return point;
}

Interpolant::Point Interpolant::InStep(Index k, double tau) {
  const double begin = solution_.times[k], end = solution_.times[k + 1];
  const double part = tau / (end - begin);
  const Vector x_begin = solution_.x.col(k), y_begin = solution_.y.col(k), y_end = LeftY(k + 1);
  Point point;
  point.y = solution_.dense_output->y_is_linear ? Vector((1 - part) * y_begin + part * y_end) : y_end;
  if (solution_.dense_output->x_is_linear) {
    point.x = (1 - part) * x_begin + part * LeftState(k + 1);
    return point;
  }
  const Vector f_begin = SourceAt(f_, begin, Side::kRight), f_end = SourceAt(f_, end, Side::kLeft);
  const Vector s_begin = problem_.B * (solution_.dense_output->y_is_linear ? y_begin : y_end) + f_begin;
  const Vector s = problem_.B * point.y + (1 - part) * f_begin + part * f_end;
  const PhiFunctions phi = ComputePhiFunctions(tau * problem_.A.Dense());
  point.x = phi.phi0 * x_begin + tau * (phi.phi1 * s_begin + phi.phi2 * (s - s_begin));
  return point;
}

Interpolant::Point Interpolant::InPiece(double time, Side side) const {
  const std::vector<TrajectoryPiece>& pieces = solution_.pieces;
  // The first piece that ends at `time` or after it; strictly after it for the limit from the right.
  const auto ends_before = [side](const TrajectoryPiece& piece, double t) {
    return side == Side::kLeft ? piece.end < t : piece.end <= t;
  };
  auto piece = std::lower_bound(pieces.begin(), pieces.end(), time, ends_before);
  if (piece == pieces.end()) --piece;
  const LegendreVector values = LegendreValues(std::clamp(2 * (time - piece->begin) / piece->length - 1, -1.0, 1.0));
  return {piece->x * values.head(piece->x.cols()), (piece->y * values.head(piece->y.cols())).cwiseMax(0),
          (piece->w * values.head(piece->w.cols())).cwiseMax(0)};
}

Vector Interpolant::LeftState(Index k) const {
  Vector x = solution_.x.col(k);
  for (const StateJump& jump : solution_.jumps) {
    if (jump.time == solution_.times[k]) x -= jump.dx;
  }
  return x;
}

Vector Interpolant::LeftY(Index k) const {
  const std::vector<LeftLimit>& limits = solution_.left_limits;
  const auto limit = std::lower_bound(limits.begin(), limits.end(), k,
                                      [](const LeftLimit& a, Index column) { return a.column < column; });
  return limit != limits.end() && limit->column == k ? limit->y : Vector(solution_.y.col(k));
}

}  // namespace dlcs
