// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/iterative_stepper.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using State = IterativeStep::State;

// A state, and when it is: in steps from the last node.
struct Known {
  double at;
  const State* state;
};

// The polynomial through all of them.
State PolynomialAt(double at, const std::vector<Known>& known) {
  State sum{.z = Vector::Zero(known[0].state->z.size()),
            .multipliers = Vector::Zero(known[0].state->multipliers.size())};
  for (const Known& one : known) {
    double weight = 1;
    for (const Known& other : known) {
      if (&other != &one) weight *= (at - other.at) / (one.at - other.at);
    }
    sum.z += weight * one.state->z;
    sum.multipliers += weight * one.state->multipliers;
  }
  return sum;
}

// Step j alone, as a segment.
Segment StepOf(const Segment& segment, Index j) {
  Segment one;
  one.first_node = segment.first_node + j - 1;
  one.steps = 1;
  one.step = segment.step;
  one.f = segment.f.middleCols(j - 1, 2);
  one.g = segment.g.middleCols(j - 1, 2);
  one.x = segment.x.middleCols(j - 1, 2);
  one.y = segment.y.middleCols(j - 1, 2);
  return one;
}

}  // namespace

IterativeStepper::IterativeStepper(std::unique_ptr<IterativeStep> step, DirectFactory make_direct, const Grid& grid,
                                   IterativeAccount& account, Progress& progress)
    : step_(std::move(step)),
      scheme_(step_->rule().Description()),
      make_direct_(std::move(make_direct)),
      grid_(grid),
      account_(account),
      progress_(progress) {}

LcpStatus IterativeStepper::TakeSteps(Segment& segment, const std::stop_token& stop, SelectionStats& departures,
                                      Index& solved) {
  step_->rule().StartWithSources(segment);
  nodes_.clear();
  Add(step_->StateOf(segment.x.col(0), segment.y.col(0), segment.g.col(0)));
  solved = 0;
  try {
    for (; solved < segment.steps && !stop.stop_requested(); ++solved) {
      const Index j = solved + 1;
      progress_.At(grid_.times[segment.first_node + solved]);
      const BoundedSolverCounts before = step_->solver().counts();
      LcpStatus verdict = TakeStep(segment, j);
      const BoundedSolverCounts& after = step_->solver().counts();
      account_.linear_iterations += after.linear_iterations - before.linear_iterations;
      account_.set_changes += after.changes - before.changes;
      if (verdict != LcpStatus::kSolved && verdict != LcpStatus::kNonFinite) {
        verdict = TakeDirectStep(segment, j, stop, departures);
      }
      if (verdict != LcpStatus::kSolved) return verdict;
    }
  } catch (const Stopped&) {
    // In the middle of a step: those before it are kept.
  }
  return LcpStatus::kSolved;
}

LcpStatus IterativeStepper::TakeStep(Segment& segment, Index j) {
  std::vector<Known> known;
  for (int k = 0; k <= degree_; ++k) known.push_back({static_cast<double>(-k), &nodes_[static_cast<std::size_t>(k)]});
  State state = PolynomialAt(step_->rule().has_stage() ? StepRule::kStage : 1, known);
  if (step_->rule().has_stage()) {
    const Vector right = step_->rule().StartStage(segment, j, stage_);
    if (const LcpStatus verdict = step_->Solve(right, stage_.g.col(1), state); verdict != LcpStatus::kSolved) {
      return verdict;
    }
    stage_.x.col(1) = step_->StatesOf(state);
    if (known.size() > 1) known.pop_back();
    const State at_stage = std::move(state);
    known.push_back({StepRule::kStage, &at_stage});
    state = PolynomialAt(1, known);
  }
  const Vector right = step_->rule().RightHandSide(segment, j, stage_);
  const LcpStatus verdict = step_->Solve(right, segment.g.col(j), state);
  if (verdict != LcpStatus::kSolved) return verdict;
  segment.x.col(j) = step_->StatesOf(state);
  segment.y.col(j) = step_->PairsOf(state);
  Add(std::move(state));
  return LcpStatus::kSolved;
}

void IterativeStepper::Add(State state) {
  nodes_.push_front(std::move(state));
  if (nodes_.size() > kMostDegree + 2) nodes_.pop_back();
  // The error of the prediction of degree d was the difference of order d + 1, Σ_k (-1)^k C(d + 1, k) z_k.
  const int known = static_cast<int>(nodes_.size()) - 1;
  double least = std::numeric_limits<double>::infinity();
  degree_ = 0;
  for (int d = 0; d < known; ++d) {
    Vector difference = nodes_[0].z;
    double binomial = 1;
    for (int k = 1; k <= d + 1; ++k) {
      binomial *= -static_cast<double>(d + 2 - k) / k;
      difference += binomial * nodes_[static_cast<std::size_t>(k)].z;
    }
    if (const double error = step_->SizeOf(difference); error < least) {
      least = error;
      degree_ = d;
    }
  }
  // One that could not be tried yet, where higher degrees were better so far.
  if (degree_ == known - 1 && known <= kMostDegree) degree_ = known;
}

LcpStatus IterativeStepper::TakeDirectStep(Segment& segment, Index j, const std::stop_token& stop,
                                           SelectionStats& departures) {
  if (!direct_) direct_ = make_direct_();
  if (!direct_) return LcpStatus::kPivotLimit;
  Segment one = StepOf(segment, j);
  Index solved = 0;
  const LcpStatus verdict = direct_->TakeSteps(one, stop, departures, solved);
  if (solved == 0) {
    if (verdict == LcpStatus::kSolved) throw Stopped();
    return verdict;
  }
  ++account_.direct_steps;
  segment.x.col(j) = one.x.col(1);
  segment.y.col(j) = one.y.col(1);
  nodes_.clear();
  Add(step_->StateOf(one.x.col(1), one.y.col(1), one.g.col(1)));
  return LcpStatus::kSolved;
}

}  // namespace dlcs
