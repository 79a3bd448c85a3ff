// SPDX-License-Identifier: Apache-2.0
// Time stepping by iterative steps.

#ifndef DLCS_CORE_STEPPING_ITERATIVE_STEPPER_H_
#define DLCS_CORE_STEPPING_ITERATIVE_STEPPER_H_

#include <deque>
#include <functional>
#include <memory>
#include <stop_token>

#include "core/context/solve_context.h"
#include "core/stepping/iterative_account.h"
#include "core/stepping/iterative_step.h"
#include "core/stepping/stepping.h"

namespace dlcs {

// Each step starts from the polynomial through some nodes before it, of the degree up to three that would have
// predicted the last one best; the second of two stages from one through the first stage too. Where an active set is
// not found or the iteration does not converge, `make_direct` makes the stepper that takes that step; null where that
// would be too large.
class IterativeStepper final : public SegmentStepper {
 public:
  using DirectFactory = std::function<std::unique_ptr<Stepper>()>;

  // Counts in `account` and reports each step of `grid` to `progress`; all three must outlive it.
  IterativeStepper(std::unique_ptr<IterativeStep> step, DirectFactory make_direct, const Grid& grid,
                   IterativeAccount& account, Progress& progress);

  const Scheme& scheme() const override { return scheme_; }
  Index lcps_of_a_step() const override { return step_->rule().has_stage() ? 2 : 1; }
  // The first steps of a segment have few nodes to start from.
  Index least_steps() const override { return 8; }
  LcpStatus TakeSteps(Segment& segment, const std::stop_token& stop, SelectionStats& departures,
                      Index& solved) override;

 private:
  static constexpr int kMostDegree = 3;

  LcpStatus TakeStep(Segment& segment, Index j);
  // Adds the state at the next node, and chooses the degree of the next prediction.
  void Add(IterativeStep::State state);
  LcpStatus TakeDirectStep(Segment& segment, Index j, const std::stop_token& stop, SelectionStats& departures);

  std::unique_ptr<IterativeStep> step_;
  Scheme scheme_;
  DirectFactory make_direct_;
  std::unique_ptr<Stepper> direct_;
  const Grid& grid_;
  IterativeAccount& account_;
  Progress& progress_;
  Segment stage_;
  std::deque<IterativeStep::State> nodes_;  // of this segment, the last one first; equally far apart
  int degree_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_ITERATIVE_STEPPER_H_
