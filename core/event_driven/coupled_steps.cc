// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/coupled_steps.h"

#include <memory>

namespace dlcs {

CoupledSteps::CoupledSteps(const Problem& problem, Selection selection, SourceSampler& sources)
    : problem_(problem), sources_(sources), steppers_([&problem, selection](double step) {
        return std::make_unique<Stepper>(problem, ExponentialPiecewiseConstant(problem, step), selection);
      }) {
  segment_.steps = 1;
  segment_.f.resize(problem.num_states(), 2);
  segment_.x.resize(problem.num_states(), 2);
  segment_.g.resize(problem.num_constraints(), 2);
  segment_.y = Matrix::Zero(problem.num_constraints(), 2);
}

CoupledSteps::Step CoupledSteps::Take(double begin, double end, double length, const Eigen::Ref<const Vector>& x) {
  const double middle = begin + length / 2;
  Step step;
  step.verdict = TakeSteps(begin, end, length, x);
  if (step.verdict != LcpStatus::kSolved) return step;
  const Vector coarse = segment_.x.col(1);
  step.verdict = TakeSteps(begin, middle, length / 2, x);
  if (step.verdict != LcpStatus::kSolved) return step;
  const Vector x_middle = segment_.x.col(1);
  step.verdict = TakeSteps(middle, end, length / 2, x_middle);
  step.kept_selection = departures_.steps_off_selection == 0;
  step.x = segment_.x.col(1);
  step.y = segment_.y.col(1);
  step.g = segment_.g.col(1);
  step.w = problem_.N * step.x + step.g + problem_.M * step.y;
  step.error = (step.x - coarse).cwiseAbs();
  step.inside = (x_middle - (x / 2 + step.x / 2)).cwiseAbs();
  constexpr double kRounding = 1e-14;
  step.noise = kRounding * (x.cwiseAbs().cwiseMax(step.x.cwiseAbs()) +
                            length * (problem_.B.AbsTimes(step.y.cwiseAbs()) + segment_.f.col(1).cwiseAbs()));
  return step;
}

LcpStatus CoupledSteps::TakeSteps(double begin, double end, double length, const Eigen::Ref<const Vector>& x) {
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
