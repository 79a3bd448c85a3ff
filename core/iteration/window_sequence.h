// SPDX-License-Identifier: Apache-2.0
// Window after window: widths, rejections, and what is said about them.

#ifndef DLCS_CORE_ITERATION_WINDOW_SEQUENCE_H_
#define DLCS_CORE_ITERATION_WINDOW_SEQUENCE_H_

#include <functional>
#include <memory>

#include "core/iteration/window_control.h"
#include "core/iteration/window_iteration.h"

namespace dlcs {

class WindowSequence {
 public:
  explicit WindowSequence(SolveContext& context);

  bool width_is_fixed() const { return context_.options.window_steps != 0; }
  // The number of steps that the next window may have, or those that are gathered to be in flight together.
  Index Width() const;
  // Sets the first width where it is chosen: that of L κ W h near 1, `kernel_bound` = κ h, or a guess where no L is
  // known.
  void Begin(const std::function<double()>& kernel_bound);

  // What the next window depends on, for checkpoints.
  friend void CarryFields(StateArchive& state, WindowSequence& windows) {
    state(windows.width_, windows.number_, windows.guess_);
  }

  // Takes the next window: `gather` makes one of at most Width() steps from where the last one ended, or null where it
  // has ended the solve; it is called again with half the width until the window converges, or is one step and marched.
  // Returns the window, finished, or null where the solve has ended. Where a window of fixed width only ran out of
  // iterations the solve has failed, but the last iterate is still returned, for the trajectory; the next call returns
  // null.
  using Gather = std::function<std::unique_ptr<WindowModel>()>;
  std::unique_ptr<WindowModel> Take(const Gather& gather);

 private:
  std::unique_ptr<WindowModel> GatherFlight(const Gather& gather);
  // Iterates on `window`, by the first steps of `flight` where there is one.
  WindowResult Iterate(WindowModel& window, WindowModel* flight);
  bool FailFixedWindow(const WindowResult& result, double begin, double end);

  SolveContext& context_;
  WindowIteration iteration_;
  WindowWidth width_{kFirstWindow};  // where it is not fixed
  Index number_ = 0;
  Index in_flight_;
  Index gathered_ = 1;  // windows at a time
  Matrix guess_;        // y behind the last window, from its flight
  bool ended_ = false;
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_SEQUENCE_H_
