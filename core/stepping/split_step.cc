// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/split_step.h"

#include <utility>

#include "core/context/solve_context.h"
#include "core/lcp/basis/tolerance.h"

namespace dlcs {

SplitStep::SplitStep(std::optional<BandSplitting> splitting, MakeStep make_step) : make_step_(std::move(make_step)) {
  if (splitting) splitting_.emplace(*std::move(splitting));
}

void SplitStep::StartFrom(const Eigen::Ref<const Vector>& y) {
  patience_ = kPatience;
  start_ = y;
  if (step_) step_->StartFrom(start_);
}

LcpStatus SplitStep::Solve(const Vector& q, const Vector& size, SelectionStats& departures, Eigen::Ref<Vector> y) {
  if (splitting_ && patience_ > 0) {
    tolerance_ = kLcpTolerance * size;
    if (splitting_->Solve(q, tolerance_, y) == SplittingVerdict::kSolved) return LcpStatus::kSolved;
    --patience_;
  }
  if (!step_) {
    step_ = make_step_();
    step_->StartFrom(start_);
  }
  return step_->Solve(q, size, departures, y);
}

}  // namespace dlcs
