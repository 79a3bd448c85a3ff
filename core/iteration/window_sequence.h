// SPDX-License-Identifier: Apache-2.0
// The sequence of windows: widths, rejections, and their events.

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
  // The largest number of steps of the next window, or of all windows that will be in flight together.
  Index Width() const;
  // Sets the first width, unless the options fix it: L κ W h near 1 with `kernel_bound` = κ h, or a guess if L is not
  // known.
  void Begin(const std::function<double()>& kernel_bound);

  // The state that the next window depends on, for checkpoints.
  friend void CarryFields(StateArchive& state, WindowSequence& windows) {
    state(windows.width_, windows.number_, windows.guess_);
  }

  // Solves the next window. `gather` makes a window of at most Width() steps from the end of the last one, or returns
  // null if it has ended the solve. It is called again with half the width until the window converges, or until it is a
  // single step, which is then solved by the coupled LCP. Returns the finished window, or null if the solve has ended.
  // If a window of fixed width ran out of iterations the solve has failed, but the last iterate is still returned, for
  // the trajectory; the next call returns null.
  using Gather = std::function<std::unique_ptr<WindowModel>()>;
  std::unique_ptr<WindowModel> Take(const Gather& gather);

 private:
  std::unique_ptr<WindowModel> GatherFlight(const Gather& gather);
  // Iterates on `window`, as the first steps of `flight` if that is given.
  WindowResult Iterate(WindowModel& window, WindowModel* flight);
  bool FailFixedWindow(const WindowResult& result, double begin, double end);

  SolveContext& context_;
  WindowIteration iteration_;
  WindowWidth width_{kFirstWindow};  // if the options do not fix it
  Index number_ = 0;
  Index in_flight_;
  Index gathered_ = 1;  // number of windows in flight
  Matrix guess_;        // y after the last window, from its flight
  bool ended_ = false;
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_SEQUENCE_H_
