// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/newton_bounds.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/feasible_ball.h"
#include "core/lcp/lcp.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// ‖A x0 + B y(N x0 + g(t)) + f(t)‖ as a function of time.
class SpeedAtStart {
 public:
  static absl::StatusOr<SpeedAtStart> Create(const Problem& problem, const SolutionChoice& choice) {
    const TimeAxis axis = AxisOf(problem);
    auto f = TimeFunctionEvaluator::Create(problem.f, problem.num_states(), axis);
    if (!f.ok()) return f.status();
    auto g = TimeFunctionEvaluator::Create(problem.g, problem.num_constraints(), axis);
    if (!g.ok()) return g.status();
    return SpeedAtStart(problem, choice, *std::move(f), *std::move(g));
  }

  Vector g(double time, Side side) {
    Vector value(problem_.num_constraints());
    g_.Evaluate(time, side, value);
    return value;
  }

  // Absent where LCP(N x0 + g, M) has no solution.
  std::optional<double> At(double time, Side side) {
    const Vector g_now = g(time, side);
    const Vector tolerance = kLcpTolerance * SizeOfSums(problem_.N, problem_.x0, g_now);
    Vector y(problem_.num_constraints());
    if (solver_->Solve(problem_.N * problem_.x0 + g_now, tolerance, basis_, y) != LcpStatus::kSolved) {
      return std::nullopt;
    }
    Vector f_now(problem_.num_states());
    f_.Evaluate(time, side, f_now);
    return MaxAbs(problem_.A * problem_.x0 + problem_.B * y + f_now);
  }

 private:
  SpeedAtStart(const Problem& problem, const SolutionChoice& choice, TimeFunctionEvaluator f, TimeFunctionEvaluator g)
      : problem_(problem),
        f_(std::move(f)),
        g_(std::move(g)),
        solver_(MakeLcpSolver(problem.M, choice)),
        basis_(problem.num_constraints(), 0) {}

  const Problem& problem_;
  TimeFunctionEvaluator f_, g_;
  std::unique_ptr<LcpSolver> solver_;
  Basis basis_;
};

bool IsConstant(const TimeFunction& function) {
  return function.pieces.size() == 1 && std::holds_alternative<ConstantFunction>(function.pieces.front().function);
}

// 257 even times of [0, end] and the break points between them.
std::vector<double> SampleTimes(const Problem& problem, double end) {
  constexpr int kIntervals = 256;
  std::vector<double> times;
  for (int k = 0; k <= kIntervals; ++k) times.push_back(end * k / kIntervals);
  for (const double time : BreakPoints(problem)) {
    if (time < end) times.push_back(time);
  }
  std::sort(times.begin(), times.end());
  return times;
}

// ρ for q0 = N x0 + g.
std::optional<double> FeasibleRadius(const Problem& problem, const SolutionChoice& choice, const Vector& g) {
  if (choice.selection == Selection::kUnique) return HUGE_VAL;
  return LargestFeasibleBall(problem.N * problem.x0 + g, problem.M).radius;
}

// γ/(c_0 + κγ), also for an infinite γ.
double TimeToLeave(double gamma, double speed, double kappa) {
  if (gamma == HUGE_VAL) return kappa > 0 ? 1 / kappa : HUGE_VAL;
  const double rate = speed + kappa * gamma;
  return rate > 0 ? gamma / rate : HUGE_VAL;
}

}  // namespace

std::optional<double> RightHandSideLipschitz(const Problem& problem, const std::optional<double>& lipschitz) {
  if (!lipschitz) return std::nullopt;
  return InfinityNorm(problem.A) + *lipschitz * InfinityNorm(problem.B) * InfinityNorm(problem.N);
}

absl::StatusOr<std::optional<FirstStep>> BoundFirstStep(const Problem& problem, const SolutionChoice& choice,
                                                        double kappa, double step) {
  auto speed = SpeedAtStart::Create(problem, choice);
  if (!speed.ok()) return speed.status();
  const std::optional<double> c = speed->At(step, Side::kLeft);
  if (!c) return std::nullopt;
  FirstStep first{.step = step, .speed = *c, .gamma = {}, .gamma_1 = {}, .room = {}};
  if (step * kappa < 1) first.gamma = step * *c / (1 - step * kappa);
  if (3 * step * kappa < 1) first.gamma_1 = step * *c / (1 - 3 * step * kappa);
  const auto radius = FeasibleRadius(problem, choice, speed->g(step, Side::kLeft));
  if (radius) first.room = FeasibleStateRadius(*radius, 0, problem.N);
  return first;
}

absl::StatusOr<std::optional<GuaranteedInterval>> GuaranteeInterval(const Problem& problem,
                                                                    const SolutionChoice& choice, double kappa) {
  auto speed = SpeedAtStart::Create(problem, choice);
  if (!speed.ok()) return speed.status();
  const Vector g0 = speed->g(0, Side::kRight);
  const auto radius = FeasibleRadius(problem, choice, g0);
  const std::optional<double> c = speed->At(0, Side::kRight);
  if (!radius || !(*radius > 0) || !c) return std::nullopt;

  // T_0 is no longer than with c_0 and γ as they are at 0.
  const double longest = TimeToLeave(FeasibleStateRadius(*radius, 0, problem.N), *c, kappa);
  GuaranteedInterval best{.gamma = FeasibleStateRadius(*radius, 0, problem.N),
                          .speed = *c,
                          .sampled = !IsConstant(problem.f) || !IsConstant(problem.g)};
  double drift = 0, c0 = *c;
  for (const double time : SampleTimes(problem, std::min(problem.horizon, longest))) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      if ((time == 0 && side == Side::kLeft) || (time == problem.horizon && side == Side::kRight)) continue;
      const std::optional<double> moved = speed->At(time, side);
      if (!moved) return best;
      drift = NanMax(drift, MaxAbs(speed->g(time, side) - g0));
      c0 = NanMax(c0, *moved);
      const double gamma = FeasibleStateRadius(*radius, drift, problem.N);
      const double interval = std::min(time, TimeToLeave(gamma, c0, kappa));
      if (!(gamma > 0) || interval < best.interval) return best;
      best = {.interval = interval, .horizon = time, .gamma = gamma, .speed = c0, .sampled = best.sampled};
    }
  }
  return best;
}

}  // namespace dlcs
