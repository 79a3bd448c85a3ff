// SPDX-License-Identifier: Apache-2.0

#include "core/methods/laplace_iteration.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/analysis/laplace_bounds.h"
#include "core/methods/consistency.h"
#include "core/methods/step_cache.h"
#include "core/methods/window.h"
#include "core/methods/window_control.h"
#include "core/methods/window_iteration.h"

namespace dlcs {
namespace {

// A node of the grid: `step` steps into a run.
struct Position {
  size_t run = 0;
  Index step = 0;
};

class Iteration {
 public:
  explicit Iteration(SolveContext& context)
      : context_(context),
        runs_(context.grid.runs),
        window_iteration_(context, !width_is_fixed()),
        tools_([&context](double step) { return std::make_unique<StepTools>(context, step); }),
        x_(context.problem.x0),
        y_(Vector::Zero(context.problem.num_constraints())) {}

  bool ReachEnd() {
    if (!width_is_fixed()) width_ = FirstWidth();
    for (Position at; at.run < runs_.size();) {
      if (at.step == 0 && runs_[at.run].starts_at_break && !Start(at)) return false;
      if (!Advance(at)) return false;
    }
    return true;
  }

 private:
  bool width_is_fixed() const { return context_.options.window_steps != 0; }

  Index Width() const {
    const Index wanted = context_.options.window_steps;
    return wanted == Options::kWholeHorizon ? context_.grid.num_steps() : wanted > 0 ? wanted : width_;
  }

  Index FirstWidth() {
    if (!context_.matrix_class.lipschitz) return kFirstWindow;
    StepTools& tools = tools_.At(runs_.front().step);
    tools.kernel.Reserve(2, context_.stop);
    const double rate = *context_.matrix_class.lipschitz * tools.kernel.Bound(2) * tools.scheme().step;
    return static_cast<Index>(RecommendedWindow(rate, static_cast<double>(kLongestWindow)));
  }

  double Time(const Position& at) const { return context_.grid.times[runs_[at.run].first_node + at.step]; }

  // y, and perhaps x, at a break point.
  bool Start(const Position& at) {
    Segment first;
    if (const auto bad = context_.sources.Sample(context_.grid, runs_[at.run], 0, 1, first)) {
      return context_.FailNonFinite(*bad);
    }
    bool y_is_solution = false;
    if (!StartStretch(context_, Time(at), first.g.col(0), x_, y_, y_is_solution)) return false;
    return y_is_solution || FailLcp(context_, LcpVerdict::kInfeasible, Time(at), "LCP(N x + g, M)");
  }

  // Whether a window from `at` goes on into the next run. A run that fills much of a window is better served alone,
  // by a convolution; in a window over several lengths of steps every iteration costs O(m²) a step.
  bool Crosses(const Position& at) const {
    constexpr Index kFew = 4, kMuch = 4;  // 4 steps, a quarter
    if (at.run + 1 == runs_.size() || runs_[at.run + 1].starts_at_break) return false;
    const Index rest = runs_[at.run].steps - at.step;
    return rest < Width() && (width_is_fixed() || rest <= kFew || kMuch * rest < Width());
  }

  // The window from `at` on, and where it ends: at the width, at a break point, or where the next length of steps
  // would be one too many to be kept.
  std::optional<Window> Gather(Position& at) {
    Window window;
    std::vector<double> lengths;
    const bool crosses = Crosses(at);
    do {
      const Run& run = runs_[at.run];
      const auto is_known = [&](double length) { return IsSameStep(length, run.step); };
      if (std::none_of(lengths.begin(), lengths.end(), is_known)) {
        if (lengths.size() == kCachedSteps) break;
        lengths.push_back(run.step);
      }
      StepTools& tools = tools_.At(run.step);
      Index steps = std::min(Width() - window.steps, run.steps - at.step);
      if (!crosses) {
        tools.kernel.Reserve(steps, context_.stop);
        steps = std::min(steps, tools.kernel.longest_window());
      }
      Segment segment;
      if (const auto bad = context_.sources.Sample(context_.grid, run, at.step, steps, segment)) {
        context_.FailNonFinite(*bad);
        return std::nullopt;
      }
      window.Append(tools, std::move(segment));
      at.step += steps;
      if (at.step == run.steps) at = {at.run + 1, 0};
    } while (crosses && window.steps < Width() && at.run < runs_.size() && !runs_[at.run].starts_at_break);
    return window;
  }

  // Takes one window from `at` on, shrinking it until it converges, and moves `at` to its end. Returns false when
  // the solve has ended.
  bool Advance(Position& at) {
    for (;;) {
      Position next = at;
      std::optional<Window> window = Gather(next);
      if (!window) return false;
      const double begin = Time(at), end = context_.grid.times[window->first_node() + window->steps];
      context_.observer.OnWindowStarted({number_, begin, end, window->steps});
      const WindowResult result = window_iteration_.Run(number_, x_, y_, *window);
      if (result.end == WindowEnd::kCancelled) return context_.FailCancelled(begin);
      const bool jumped = result.end == WindowEnd::kJump;
      const bool march = result.end != WindowEnd::kConverged && !jumped && window->steps == 1 && !width_is_fixed();
      bool accepted = result.end == WindowEnd::kConverged;
      LcpVerdict verdict = LcpVerdict::kSolved;
      Departures departures;
      if (march) accepted = March(window->pieces.front(), verdict, departures);
      context_.observer.OnWindowFinished({number_, end, result.iterations, accepted, march, result.why});
      ++number_;
      ++context_.solution.cost.windows;
      if (accepted) {
        Accept(*window, result.iterations, march);
        at = next;
        return true;
      }
      if (context_.stop.stop_requested()) return context_.FailCancelled(begin);
      if (departures.steps_off_selection > 0) {
        return context_.y_is_lipschitz() ? context_.FailLostLeastElement(end)
                                         : context_.FailJump(end, "the coupled step has other solutions only");
      }
      if (jumped && (window->steps == 1 || width_is_fixed())) return context_.FailJump(end, result.why);
      if (march) return FailLcp(context_, verdict, end, "The coupled step LCP(q, M + K_0)");
      if (width_is_fixed()) return FailFixedWindow(result, begin, end);
      width_ = std::max<Index>(1, window->steps / 2);
    }
  }

  // Marches the one step of `piece`.
  bool March(WindowPiece& piece, LcpVerdict& verdict, Departures& departures) {
    Index solved = 0;
    verdict = piece.tools->marcher.March(piece.segment, context_.stop, departures, solved);
    const bool accepted = verdict == LcpVerdict::kSolved && solved == 1;
    context_.solution.cost.lcps += 1;
    context_.solution.cost.marched_steps += accepted;
    return accepted;
  }

  bool FailFixedWindow(const WindowResult& result, double begin, double end) {
    const bool limit = result.end == WindowEnd::kIterationLimit;
    return context_.Fail(limit ? Termination::kIterationLimit : Termination::kDiverged, begin,
                         "The window [" + FormatNumber(begin) + ", " + FormatNumber(end) + "] failed after " +
                             std::to_string(result.iterations) + " iterations: " + result.why +
                             ". Automatic windows would shrink it.");
  }

  void Accept(const Window& window, Index iterations, bool marched) {
    for (const WindowPiece& piece : window.pieces) context_.Add(piece.segment, piece.tools->scheme());
    context_.solution.cost.steps += window.steps;
    const Segment& last = window.pieces.back().segment;
    x_ = last.x.col(last.steps);
    y_ = last.y.col(last.steps);
    if (width_is_fixed()) return;
    // After a marched step there is no use in trying more before one step iterates again.
    width_ = marched ? 1 : NextWidth(width_, window.steps, iterations);
  }

  SolveContext& context_;
  const std::vector<Run>& runs_;
  WindowIteration window_iteration_;
  StepCache<StepTools> tools_;
  Vector x_;  // at the start of the next window
  Vector y_;
  Index width_ = 0;  // where it is not fixed
  Index number_ = 0;
};

}  // namespace

bool LaplaceIteration(SolveContext& context) {
  context.solution.kernel.emplace();
  return Iteration(context).ReachEnd();
}

}  // namespace dlcs
