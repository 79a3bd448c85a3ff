// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/step_rule.h"

#include <cmath>

namespace dlcs {
namespace {

// Table: γ of the rule with two stages.
const double kGamma = 1 - std::sqrt(0.5);

double Weight(SparseRule rule, double step) {
  switch (rule) {
    case SparseRule::kTheta:
      return step;
    case SparseRule::kAveraged:
      return step / 2;
    case SparseRule::kTwoStages:
      return kGamma * step;
  }
  return step;
}

}  // namespace

const double StepRule::kStage = kGamma;

StepRule::StepRule(const Problem& problem, double step, SparseRule rule, double theta)
    : problem_(problem),
      step_(step),
      rule_(rule),
      theta_(rule == SparseRule::kAveraged ? 0.5
             : rule == SparseRule::kTheta  ? theta
                                           : 0),
      weight_(Weight(rule, step)),
      shift_(rule == SparseRule::kTheta ? step * (1 - theta) : weight_) {}

Scheme StepRule::Description() const {
  Scheme scheme;
  scheme.step = step_;
  scheme.x_is_linear = true;
  scheme.y_is_linear = rule_ != SparseRule::kTheta;
  scheme.order = rule_ == SparseRule::kTheta ? 1 : 2;
  return scheme;
}

void StepRule::StartWithSources(Segment& segment) const {
  auto x = segment.x.rightCols(segment.steps);
  x = weight_ * segment.f.rightCols(segment.steps);
  if (rule_ == SparseRule::kAveraged) x += weight_ * segment.f.leftCols(segment.steps);
}

Vector StepRule::RightHandSide(const Segment& segment, Index j, const Segment& stage) const {
  const auto before = segment.x.col(j - 1);
  Vector moved = before;
  if (has_stage()) moved += (1 - kGamma) / kGamma * (stage.x.col(1) - before);
  Vector sum = segment.x.col(j) + problem_.MassTimes(moved);
  if (theta_ > 0) sum += step_ * theta_ * (problem_.A * before);
  if (rule_ == SparseRule::kAveraged) sum += weight_ * (problem_.B * segment.y.col(j - 1));
  return sum;
}

Vector StepRule::StartStage(const Segment& segment, Index j, Segment& stage) const {
  const auto at_stage = [&](const Matrix& source) -> Vector {
    return (1 - kGamma) * source.col(j - 1) + kGamma * source.col(j);
  };
  stage.x.resize(segment.x.rows(), 2);
  stage.y.resize(segment.y.rows(), 2);
  stage.g.resize(segment.g.rows(), 2);
  stage.g.col(1) = at_stage(segment.g);
  return problem_.MassTimes(segment.x.col(j - 1)) + weight_ * at_stage(segment.f);
}

}  // namespace dlcs
