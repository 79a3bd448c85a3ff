// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/iterative_stepper.h"

#include <algorithm>
#include <utility>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using State = IterativeStep::State;

// to + factor (to - from)
State Extrapolated(const State& from, const State& to, double factor) {
  return {.z = to.z + factor * (to.z - from.z),
          .multipliers = to.multipliers + factor * (to.multipliers - from.multipliers)};
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
  last_ = step_->StateOf(segment.x.col(0), segment.y.col(0), segment.g.col(0));
  has_line_ = false;
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
  State state = last_;
  if (step_->rule().has_stage()) {
    if (has_line_) state = Extrapolated(before_last_, last_, StepRule::kStage);
    const Vector right = step_->rule().StartStage(segment, j, stage_);
    if (const LcpStatus verdict = step_->Solve(right, stage_.g.col(1), state); verdict != LcpStatus::kSolved) {
      return verdict;
    }
    stage_.x.col(1) = step_->StatesOf(state);
    state = Extrapolated(last_, state, 1 / StepRule::kStage - 1);
  } else if (has_line_) {
    state = Extrapolated(before_last_, last_, 1);
  }
  const Vector right = step_->rule().RightHandSide(segment, j, stage_);
  const LcpStatus verdict = step_->Solve(right, segment.g.col(j), state);
  if (verdict != LcpStatus::kSolved) return verdict;
  segment.x.col(j) = step_->StatesOf(state);
  segment.y.col(j) = step_->PairsOf(state);
  before_last_ = std::exchange(last_, std::move(state));
  has_line_ = true;
  return LcpStatus::kSolved;
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
  last_ = step_->StateOf(one.x.col(1), one.y.col(1), one.g.col(1));
  has_line_ = false;
  return LcpStatus::kSolved;
}

}  // namespace dlcs
