// SPDX-License-Identifier: Apache-2.0
// Reports to the observer how far a time-stepping method has come.

#ifndef DLCS_CORE_CONTEXT_PROGRESS_H_
#define DLCS_CORE_CONTEXT_PROGRESS_H_

#include "core/context/solve_context.h"

namespace dlcs {

// Reports the steps taken as windows without iterates, at most one per tenth of a second.
class Progress {
 public:
  explicit Progress(SolveContext& context) : context_(context) {}

  // The solve has reached `time`.
  void At(double time) {
    // Ten reports in a second are motion to a reader; two or forty would do as well, and cost a method nothing.
    constexpr double kInterval_s = 0.1;
    const double now = context_.Seconds();
    if (open_ && now - reported_s_ < kInterval_s) return;
    if (open_) Close(time);
    reported_s_ = now;
    open_ = true;
    ++window_;
    context_.observer.OnWindowStarted({window_, time, context_.problem.horizon, 0});
  }

  void Finish(double time) {
    if (open_) Close(time);
  }

 private:
  void Close(double time) {
    WindowOutcome outcome;
    outcome.window = window_;
    outcome.end = time;
    outcome.accepted = true;
    outcome.coupled = true;
    context_.observer.OnWindowFinished(outcome);
    open_ = false;
  }

  SolveContext& context_;
  Index window_ = -1;
  bool open_ = false;
  double reported_s_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_PROGRESS_H_
