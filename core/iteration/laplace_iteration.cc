// SPDX-License-Identifier: Apache-2.0

#include "core/iteration/laplace_iteration.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/context/checkpointing.h"
#include "core/context/consistency.h"
#include "core/discretization/step_cache.h"
#include "core/iteration/reduced_iteration.h"
#include "core/iteration/window.h"
#include "core/iteration/window_sequence.h"

namespace dlcs {
namespace {

// A node of the grid: `step` steps into a run.
struct Position {
  size_t run = 0;
  Index step = 0;
};

// The iteration on states.
class Iteration {
 public:
  explicit Iteration(SolveContext& context)
      : context_(context),
        runs_(context.grid.runs),
        windows_(context),
        tools_([&context](double step) { return std::make_unique<StepTools>(context, step); }),
        x_(context.problem.x0),
        y_(Vector::Zero(context.problem.num_constraints())) {}

  bool ReachEnd() {
    Position at;
    const auto carry = [&](StateArchive& state) {
      state(windows_, at.run, at.step, x_, y_);
      CarryTools(state);
    };
    if (!ResumeFromCheckpoint(context_, carry)) return false;
    if (!context_.checkpoints.resume) Begin();
    while (at.run < runs_.size()) {
      if (at.step == 0 && runs_[at.run].starts_at_break && !Start(at)) return false;
      Position next;
      const auto window = windows_.Take([&] {
        next = at;
        return Gather(next);
      });
      if (!window) return false;
      Accept(static_cast<const Window&>(*window));
      at = next;
      OfferCheckpoint(context_, EndTime(at), carry);
    }
    return true;
  }

 private:
  void Begin() {
    windows_.Begin([&] {
      StepTools& tools = tools_.At(runs_.front().step);
      tools.kernel.Reserve(2, context_.stop);
      return tools.kernel.Bound(2) * tools.scheme().step;
    });
  }

  // Stores or restores the kernels of a checkpoint by their reservations: kernels made by the same reservations are the
  // same. Their cost is counted once.
  void CarryTools(StateArchive& state) {
    std::vector<std::vector<Index>> reservations;
    tools_.ForEach([&](double, StepTools* tools) {
      reservations.push_back(tools ? tools->kernel.reservations() : std::vector<Index>());
    });
    state(tools_, reservations);
    if (!state.reads()) return;
    const KernelRecord counted = *context_.solution.kernel;
    std::vector<double> lengths;
    tools_.ForEach([&](double length, StepTools*) { lengths.push_back(length); });
    for (std::size_t k = 0; k < std::min(lengths.size(), reservations.size()); ++k) {
      StepTools& tools = tools_.At(lengths[k]);
      for (const Index window : reservations[k]) tools.kernel.Reserve(window, context_.stop);
    }
    context_.solution.kernel = counted;
  }

  double EndTime(const Position& at) const { return at.run < runs_.size() ? Time(at) : context_.problem.horizon; }
  double Time(const Position& at) const { return context_.grid.times[runs_[at.run].first_node + at.step]; }

  // Computes y, and x where necessary, at a break point.
  bool Start(const Position& at) {
    Segment first;
    if (const auto bad = context_.sources.Sample(context_.grid, runs_[at.run], 0, 1, first)) {
      return context_.FailNonFinite(*bad);
    }
    bool y_is_solution = false;
    if (!StartInterval(context_, Time(at), first.g.col(0), x_, y_, y_is_solution)) return false;
    return y_is_solution || FailLcp(context_, LcpStatus::kInfeasible, Time(at), "LCP(N x + g, M)");
  }

  // Whether a window from `at` continues into the next run. A run that fills much of a window is solved alone, by a
  // convolution, because in a window over several step lengths every iteration costs O(m²) a step.
  bool Crosses(const Position& at) const {
    constexpr Index kFew = 4, kMuch = 4;  // 4 steps, a quarter
    if (at.run + 1 == runs_.size() || runs_[at.run + 1].starts_at_break) return false;
    const Index rest = runs_[at.run].steps - at.step, width = windows_.Width();
    return rest < width && (windows_.width_is_fixed() || rest <= kFew || kMuch * rest < width);
  }

  // The window from `at` on, and where it ends: at the width, at a break point, or where the next length of steps
  // would be one too many to be kept. Null where a source is not finite.
  std::unique_ptr<Window> Gather(Position& at) {
    auto window = std::make_unique<Window>(context_, x_, y_);
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
      Index steps = std::min(windows_.Width() - window->steps(), run.steps - at.step);
      if (!crosses) {
        tools.kernel.Reserve(steps, context_.stop);
        steps = std::min(steps, tools.kernel.longest_window());
      }
      Segment segment;
      if (const auto bad = context_.sources.Sample(context_.grid, run, at.step, steps, segment)) {
        context_.FailNonFinite(*bad);
        return nullptr;
      }
      window->Append(tools, std::move(segment));
      at.step += steps;
      if (at.step == run.steps) at = {at.run + 1, 0};
    } while (crosses && window->steps() < windows_.Width() && at.run < runs_.size() && !runs_[at.run].starts_at_break);
    return window;
  }

  void Accept(const Window& window) {
    for (const WindowPiece& piece : window.pieces()) context_.Add(piece.segment, piece.tools->scheme());
    const Segment& last = window.pieces().back().segment;
    x_ = last.x.col(last.steps);
    y_ = last.y.col(last.steps);
  }

  SolveContext& context_;
  const std::vector<Run>& runs_;
  WindowSequence windows_;
  StepCache<StepTools> tools_;
  Vector x_;  // at the start of the next window
  Vector y_;
};

}  // namespace

bool LaplaceIteration(SolveContext& context) {
  if (!context.choices.propagator) context.solution.kernel.emplace();
  const bool reached = context.choices.propagator ? ReducedIteration(context) : Iteration(context).ReachEnd();
  // The last window may have ended without converging; then a termination is set.
  return reached && context.solution.termination == Termination::kNotSolved;
}

}  // namespace dlcs
