// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/window_sequence.h"

#include <algorithm>
#include <utility>

#include "core/laplace/iteration_bounds.h"

namespace dlcs {

WindowSequence::WindowSequence(SolveContext& context)
    : context_(context),
      iteration_(context, !width_is_fixed()),
      in_flight_(context.y_is_lipschitz() && context.options.acceleration == 0 ? context.options.windows_in_flight
                                                                               : 1) {}

Index WindowSequence::Width() const {
  const Index wanted = context_.options.window_steps;
  if (wanted == Options::kWholeHorizon) return context_.grid.num_steps();
  return gathered_ * (wanted > 0 ? wanted : width_.value());
}

void WindowSequence::Begin(const std::function<double()>& kernel_bound) {
  if (width_is_fixed()) return;
  if (!context_.matrix_class.lipschitz) return;
  const double rate = *context_.matrix_class.lipschitz * kernel_bound();
  width_ = WindowWidth(static_cast<Index>(RecommendedWindow(rate, static_cast<double>(kLongestWindow))));
}

std::unique_ptr<WindowModel> WindowSequence::GatherFlight(const Gather& gather) {
  if (in_flight_ == 1) return nullptr;
  gathered_ = in_flight_;
  std::unique_ptr<WindowModel> flight = gather();
  gathered_ = 1;
  return flight;
}

WindowResult WindowSequence::Iterate(WindowModel& window, WindowModel* flight) {
  const Index steps = window.steps();
  const Matrix guess = std::exchange(guess_, Matrix());
  if (!flight || flight->steps() <= steps) return iteration_.Run(number_, window, {.steps = steps, .guess = guess});
  const WindowResult result = iteration_.Run(number_, *flight, {.steps = steps, .guess = guess});
  if (result.end == WindowEnd::kFlightFailed) return iteration_.Run(number_, window);
  window.Frozen();
  window.y.rightCols(steps) = flight->y.middleCols(1, steps);
  if (result.end != WindowEnd::kConverged) return result;
  window.Finish();
  guess_ = flight->y.rightCols(flight->steps() - steps);
  return result;
}

std::unique_ptr<WindowModel> WindowSequence::Take(const Gather& gather) {
  while (!ended_) {
    const std::unique_ptr<WindowModel> flight = GatherFlight(gather);
    std::unique_ptr<WindowModel> window = gather();
    if (!window) return nullptr;
    const Index steps = window->steps();
    const double begin = context_.grid.times[window->first_node()];
    const double end = context_.grid.times[window->first_node() + steps];
    context_.observer.OnWindowStarted({number_, begin, end, steps});
    const WindowResult result = Iterate(*window, flight.get());
    if (result.end == WindowEnd::kCancelled) return context_.FailCancelled(begin), nullptr;

    const bool jumped = result.end == WindowEnd::kJump;
    const bool coupled = result.end != WindowEnd::kConverged && !jumped && steps == 1 && !width_is_fixed();
    bool accepted = result.end == WindowEnd::kConverged;
    LcpStatus verdict = LcpStatus::kSolved;
    SelectionStats departures;
    if (coupled) {
      verdict = window->SolveCoupledStep(departures);
      accepted = verdict == LcpStatus::kSolved;
      ++context_.solution.cost.lcps;
      context_.solution.cost.coupled_steps += accepted;
    }
    context_.observer.OnWindowFinished({number_, end, result.iterations, accepted, coupled, result.why});
    ++number_;
    ++context_.solution.cost.windows;
    if (accepted) {
      context_.solution.cost.steps += steps;
      coupled ? width_.AcceptCoupledStep() : width_.Accept(steps, result.iterations);
      return window;
    }

    if (context_.stop.stop_requested()) return context_.FailCancelled(begin), nullptr;
    if (departures.steps_off_selection > 0) {
      if (context_.y_is_lipschitz()) return context_.FailLostLeastElement(end), nullptr;
      return context_.FailJump(end, "the coupled step has other solutions only"), nullptr;
    }
    if (jumped && (steps == 1 || width_is_fixed())) return context_.FailJump(end, result.why), nullptr;
    if (coupled) return FailLcp(context_, verdict, end, "The coupled step LCP(q, M + K_0)"), nullptr;
    if (width_is_fixed()) {
      ended_ = true;
      FailFixedWindow(result, begin, end);
      if (result.end != WindowEnd::kIterationLimit) return nullptr;
      context_.solution.cost.steps += steps;
      window->Finish();
      return window;
    }
    width_.Reject(steps);
  }
  return nullptr;
}

bool WindowSequence::FailFixedWindow(const WindowResult& result, double begin, double end) {
  const bool limit = result.end == WindowEnd::kIterationLimit;
  return context_.Fail(limit ? Termination::kIterationLimit : Termination::kDiverged, begin,
                       "The window [" + FormatNumber(begin) + ", " + FormatNumber(end) + "] failed after " +
                           std::to_string(result.iterations) + " iterations: " + result.why +
                           ". Automatic windows would shrink it.");
}

}  // namespace dlcs
