// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/coupled_steps.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/event_driven/step_length.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {

CoupledSteps::CoupledSteps(const Problem& problem, Selection selection, SourceSampler& sources)
    : problem_(problem),
      sources_(sources),
      steppers_([&problem, selection](double step) {
        return std::make_unique<Stepper>(problem, ExponentialPiecewiseConstant(problem, step), selection);
      }),
      shortest_(kShortestStep * problem.horizon) {
  segment_.steps = 1;
  segment_.f.resize(problem.num_states(), 2);
  segment_.x.resize(problem.num_states(), 2);
  segment_.g.resize(problem.num_constraints(), 2);
  segment_.y = Matrix::Zero(problem.num_constraints(), 2);
}

void CoupledSteps::BeginBurst(double t, double scale) {
  if (steps_ == 0) first_ = t;
  if (burst_ == 1) length_ = std::max(shortest_, std::min(scale, 1024 * shortest_));
}

bool CoupledSteps::AreHopeless(double t) const {
  constexpr Index kEnoughToKnow = kMost / 10;
  if (steps_ < kEnoughToKnow) return false;
  return (problem_.horizon - first_) * static_cast<double>(steps_) > kMost * (t - first_);
}

CoupledSteps::Step CoupledSteps::Take(double begin, double limit, const Eigen::Ref<const Vector>& x,
                                      const Vector& sizes, double tolerance) {
  const double allowed = tolerance * static_cast<double>(burst_) * static_cast<double>(burst_);
  for (;;) {
    const double power = std::ldexp(1.0, std::ilogb(length_));
    const double length = std::min(power, limit - begin);
    const double end = length == limit - begin ? limit : begin + length;
    Step step = TakeHalves(begin, end, length, x);
    if (step.verdict != LcpStatus::kSolved || !step.kept_selection) return step;
    const Vector magnitude = sizes.cwiseMax(step.x.cwiseAbs());
    const auto ratio_of = [&](const Vector& error, double of_magnitude) {
      return (error.array() /
              (of_magnitude * magnitude.array() + step.noise.array()).cwiseMax(std::numeric_limits<double>::min()))
          .maxCoeff();
    };
    const double share = ShareOfTolerance(length, problem_.horizon);
    const double ratio = NanMax(ratio_of(step.error, allowed * share), ratio_of(step.inside, allowed));
    if (ratio <= 1 || length <= shortest_) {
      if (ratio < 0.25) length_ = 2 * length;
      ++steps_;
      return step;
    }
    length_ = length / 2;
  }
}

CoupledSteps::Step CoupledSteps::TakeHalves(double begin, double end, double length,
                                            const Eigen::Ref<const Vector>& x) {
  const double middle = begin + length / 2;
  Step step;
  step.end = end;
  step.verdict = TakeStep(begin, end, length, x);
  if (step.verdict != LcpStatus::kSolved) return step;
  const Vector coarse = segment_.x.col(1);
  step.verdict = TakeStep(begin, middle, length / 2, x);
  if (step.verdict != LcpStatus::kSolved) return step;
  const Vector x_middle = segment_.x.col(1), g_middle = segment_.g.col(1);
  step.verdict = TakeStep(middle, end, length / 2, x_middle);
  step.kept_selection = departures_.steps_off_selection == 0;
  step.x = segment_.x.col(1);
  step.y = segment_.y.col(1);
  step.g = segment_.g.col(1);
  step.w = problem_.N * step.x + step.g + problem_.M * step.y;
  step.error = (step.x - coarse).cwiseAbs();
  step.inside = (x_middle - (x / 2 + step.x / 2)).cwiseAbs();
  step.w_inside = (problem_.N * Vector(step.x - x_middle) + step.g - g_middle).cwiseAbs();
  step.noise = RoundingOf(64) * (x.cwiseAbs().cwiseMax(step.x.cwiseAbs()) +
                                 length * (problem_.B.AbsTimes(step.y.cwiseAbs()) + segment_.f.col(1).cwiseAbs()));
  return step;
}

LcpStatus CoupledSteps::TakeStep(double begin, double end, double length, const Eigen::Ref<const Vector>& x) {
  segment_.step = length;
  sources_.F(begin, Side::kRight, segment_.f.col(0));
  sources_.F(end, Side::kLeft, segment_.f.col(1));
  sources_.G(begin, Side::kRight, segment_.g.col(0));
  sources_.G(end, Side::kLeft, segment_.g.col(1));
  segment_.x.col(0) = x;
  Index solved = 0;
  ++lcps_;
  return steppers_.At(length).TakeSteps(segment_, {}, departures_, solved);
}

}  // namespace dlcs
