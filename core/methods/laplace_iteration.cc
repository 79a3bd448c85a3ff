// SPDX-License-Identifier: Apache-2.0

#include "core/methods/laplace_iteration.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/analysis/laplace_bounds.h"
#include "core/laplace/kernel.h"
#include "core/lcp/batch.h"
#include "core/linalg/norms.h"
#include "core/methods/consistency.h"
#include "core/methods/marching.h"
#include "core/methods/propagation.h"
#include "core/methods/steep_step.h"
#include "core/methods/step_cache.h"
#include "core/methods/window_control.h"

namespace dlcs {
namespace {

// What depends on the step length alone.
struct StepTools {
  StepTools(SolveContext& context, double step)
      : marcher(context.problem, ExponentialPiecewiseLinear(context.problem, step), context.selection),
        kernel(context.problem, marcher.scheme(), context.options.kernel, context.workers, *context.solution.kernel) {}
  const Scheme& scheme() const { return marcher.scheme(); }
  Marcher marcher;  // for the steps that must be marched
  Kernel kernel;
};

enum class WindowEnd { kConverged, kDiverged, kInfeasibleIterate, kJump, kIterationLimit, kCancelled };

struct WindowResult {
  WindowEnd end;
  Index iterations = 0;
  std::string why;
};

class Iteration {
 public:
  explicit Iteration(SolveContext& context)
      : context_(context),
        problem_(context.problem),
        batch_(problem_.M, context.selection, problem_.selector),
        tools_([&context](double step) {
          return std::make_unique<StepTools>(context, step);
        }),
        x_(problem_.x0),
        y_(Vector::Zero(problem_.num_constraints())) {}

  bool ReachEnd() {
    for (const Run& run : context_.grid.runs) {
      StepTools& tools = tools_.At(run.step);
      width_ = FirstWidth(tools, run);
      for (Index done = 0; done < run.steps;) {
        const Index taken = Advance(tools, run, done);
        if (taken == 0) return false;
        done += taken;
      }
    }
    return true;
  }

 private:
  bool width_is_fixed() const { return context_.options.window_steps != 0; }

  Index max_iterations() const {
    if (context_.options.max_iterations > 0) return context_.options.max_iterations;
    return width_is_fixed() ? 1000 : 60;
  }

  // The width of the first window of a run; later runs go on with what the last one learned.
  Index FirstWidth(StepTools& tools, const Run& run) const {
    const Index wanted = context_.options.window_steps;
    if (wanted == Options::kWholeHorizon) return run.steps;
    if (wanted > 0) return wanted;
    if (width_ > 0) return width_;
    if (!context_.matrix_class.lipschitz) return kFirstWindow;
    tools.kernel.Reserve(2, context_.stop);
    const double rate = *context_.matrix_class.lipschitz * tools.kernel.Bound(2) * run.step;
    return static_cast<Index>(RecommendedWindow(rate, static_cast<double>(kLongestWindow)));
  }

  // Takes one window of `run` from step `done` on, shrinking it until it converges. Returns the steps taken; 0
  // when the solve has ended.
  Index Advance(StepTools& tools, const Run& run, Index done) {
    for (;;) {
      tools.kernel.Reserve(std::min(width_, run.steps - done), context_.stop);
      if (context_.stop.stop_requested()) {  // perhaps with fewer blocks than the window needs
        context_.FailCancelled(context_.grid.times[run.first_node + done]);
        return 0;
      }
      const Index steps = std::min({width_, run.steps - done, tools.kernel.longest_window()});
      Segment segment;
      if (const auto bad = context_.sources.Sample(context_.grid, run, done, steps, segment)) {
        context_.FailNonFinite(*bad);
        return 0;
      }
      const double begin = context_.grid.times[segment.first_node];
      const double end = context_.grid.times[segment.first_node + steps];
      if (done == 0 && run.starts_at_break && !started_) {
        bool y_is_solution = false;
        if (!StartStretch(context_, begin, segment.g.col(0), x_, y_, y_is_solution)) return 0;
        if (!y_is_solution) {
          FailLcp(context_, LcpVerdict::kInfeasible, begin, "LCP(N x + g, M)");
          return 0;
        }
        started_ = true;  // not again when the window is retried shorter
      }
      context_.observer.OnWindowStarted({window_, begin, end, steps});
      WindowResult result = Iterate(tools, segment);
      if (result.end == WindowEnd::kCancelled) {
        context_.FailCancelled(begin);
        return 0;
      }
      const bool jumped = result.end == WindowEnd::kJump;
      const bool march = result.end != WindowEnd::kConverged && !jumped && steps == 1 && !width_is_fixed();
      bool accepted = result.end == WindowEnd::kConverged;
      LcpVerdict marched = LcpVerdict::kSolved;
      Departures departures;
      if (march) {
        Index solved = 0;
        marched = tools.marcher.March(segment, context_.stop, departures, solved);
        accepted = marched == LcpVerdict::kSolved && solved == 1;
        context_.solution.cost.lcps += 1;
        context_.solution.cost.marched_steps += accepted;
      }
      context_.observer.OnWindowFinished({window_, end, result.iterations, accepted, march, result.why});
      ++window_;
      ++context_.solution.cost.windows;
      if (accepted) {
        Accept(tools, segment, result.iterations, march);
        return steps;
      }
      if (context_.stop.stop_requested()) {
        context_.FailCancelled(begin);
        return 0;
      }
      if (departures.steps_off_selection > 0) {
        if (context_.y_is_lipschitz()) {
          context_.FailLostLeastElement(end);
        } else {
          context_.FailJump(end, "the coupled step has other solutions only");
        }
        return 0;
      }
      if (jumped && (steps == 1 || width_is_fixed())) {
        context_.FailJump(end, result.why);
        return 0;
      }
      if (march) {
        FailLcp(context_, marched, end, "The coupled step LCP(q, M + K_0)");
        return 0;
      }
      if (width_is_fixed()) {
        FailFixedWindow(result, begin, end);
        return 0;
      }
      width_ = std::max<Index>(1, steps / 2);
    }
  }

  void FailFixedWindow(const WindowResult& result, double begin, double end) {
    const bool limit = result.end == WindowEnd::kIterationLimit;
    context_.Fail(limit ? Termination::kIterationLimit : Termination::kDiverged, begin,
                  "The window [" + FormatNumber(begin) + ", " + FormatNumber(end) + "] failed after " +
                      std::to_string(result.iterations) + " iterations: " + result.why +
                      ". Automatic windows would shrink it.");
  }

  // The iteration on one window. Leaves y of the last iterate and, when converged, x in `segment`.
  WindowResult Iterate(StepTools& tools, Segment& segment) {
    const Index steps = segment.steps;
    segment.x.resize(problem_.num_states(), steps + 1);
    segment.y.resize(problem_.num_constraints(), steps + 1);
    segment.x.col(0) = x_;
    segment.y.col(0) = y_;
    segment.y.rightCols(steps).colwise() = y_;
    Propagate(tools.scheme(), segment);  // x^0: y frozen at y_a
    const Matrix frozen = problem_.N * segment.x.rightCols(steps) + segment.g.rightCols(steps);
    Vector size = SizeOfSums(problem_.N, segment.x, segment.g);
    Matrix q = frozen;
    bool from_constant_state = false;
    Matrix deviation(q.rows(), steps);
    const double rate = context_.matrix_class.lipschitz.value_or(0) * tools.kernel.Bound(steps) *
                        tools.scheme().step;

    WindowResult result{WindowEnd::kIterationLimit, 0, {}};
    std::vector<double> changes;  // relative to the size of each row
    double first_change = 0;
    if (!q.allFinite()) {
      result.end = WindowEnd::kDiverged;
      result.why = "the state is not finite";
      return result;
    }
    while (result.iterations < max_iterations()) {
      const Index k = ++result.iterations;
      ++context_.solution.cost.iterations;
      const double lcp_begin = context_.Seconds();
      auto y = segment.y.rightCols(steps);
      const LcpBatchOutcome lcps = batch_.Solve(q, kLcpTolerance * size, context_.workers, context_.stop, y);
      context_.solution.cost.lcps += steps;
      const double lcp_end = context_.Seconds();
      context_.solution.cost.seconds_lcp += lcp_end - lcp_begin;
      if (lcps.cancelled) {
        result.end = WindowEnd::kCancelled;
        return result;
      }
      if (lcps.verdict != LcpVerdict::kSolved && k == 1 && !from_constant_state) {
        // Theorem 3.2 of [Wu & Chen] has feasible iterates from the constant start, on windows short enough.
        from_constant_state = true;
        q = (problem_.N * x_).replicate(1, steps) + segment.g.rightCols(steps);
        y.colwise() = y_;
        result.iterations = 0;
        continue;
      }
      if (lcps.verdict != LcpVerdict::kSolved) {
        result.end = WindowEnd::kInfeasibleIterate;
        const double t = context_.grid.times[segment.first_node + 1 + lcps.column];
        result.why = std::string("the LCP of iterate ") + std::to_string(k) + " at t = " + FormatNumber(t) +
                     " ended as " + LcpVerdictName(lcps.verdict);
        return result;
      }

      if (const auto jump = FindJump(q, y, segment)) {
        result.end = WindowEnd::kJump;
        result.why = *jump;
        return result;
      }

      deviation = y.colwise() - y_;
      Matrix next = frozen + tools.kernel.convolution().Apply(deviation, context_.workers);
      const Vector row_change = RowMaxAbs(next - q);
      q.swap(next);
      size = size.cwiseMax(RowMaxAbs(q));
      const double change = RelativeChange(size, row_change);
      const double residual = NaturalResidual(y, q + problem_.M * y);
      context_.solution.cost.seconds_linear += context_.Seconds() - lcp_end;
      changes.push_back(change);
      if (k == 1) first_change = MaxAbs(row_change);
      Report(k, MaxAbs(row_change), residual, first_change, rate, steps);

      if (Converged(changes, context_.options.tolerance)) {
        result.end = WindowEnd::kConverged;
        Propagate(tools.scheme(), segment);
        return result;
      }
      if (!std::isfinite(change) || (!width_is_fixed() && Diverging(changes))) {
        result.end = WindowEnd::kDiverged;
        result.why = "the iterates diverge (N x + g changed by " + FormatNumber(change) + " of its size)";
        return result;
      }
    }
    result.why = "the change of N x + g is still " + FormatNumber(changes.back()) + " of its size";
    return result;
  }

  // Where y is a Lipschitz function only perhaps: the first step over which an iterate's y changes by more than any piece
  // of the function allows.
  std::optional<std::string> FindJump(const Matrix& q, const Eigen::Ref<const Matrix>& y, const Segment& segment) const {
    if (!context_.largest_slope) return std::nullopt;
    Matrix all_q(q.rows(), q.cols() + 1);
    all_q << problem_.N * x_ + segment.g.col(0), q;
    Matrix all_y(y.rows(), y.cols() + 1);
    all_y << y_, y;
    const auto jump = FindSteepStep(all_q, all_y, *context_.largest_slope);
    if (!jump) return std::nullopt;
    return DescribeSteepStep(*jump, context_.grid.times[segment.first_node + jump->column], *context_.largest_slope);
  }

  // The bound of change k in terms of the first: the discrete kernel is at most κ h per step, so
  // |q^{k} - q^{k-1}|_j <= (L κ h)^{k-1} C(j + k - 2, k - 1) |q^1 - q^0|, which tends to (L κ t)^{k-1}/(k-1)!.
  void Report(Index k, double change, double residual, double first_change, double rate, Index steps) {
    IterateReport report;
    report.window = window_;
    report.iteration = k;
    report.change = change;
    report.lcp_residual = residual;
    report.seconds = context_.Seconds();
    if (context_.matrix_class.lipschitz && first_change > 0) {
      const double log_bound =
          LogReducedFactor(rate, static_cast<double>(steps), static_cast<int>(k - 1)) + std::log(first_change);
      if (std::isfinite(log_bound)) report.log10_bound = log_bound / std::log(10.0);
    }
    context_.observer.OnIterate(report);
  }

  void Accept(StepTools& tools, const Segment& segment, Index iterations, bool marched) {
    context_.Add(segment, tools.scheme());
    context_.solution.cost.steps += segment.steps;
    x_ = segment.x.col(segment.steps);
    y_ = segment.y.col(segment.steps);
    started_ = false;
    if (width_is_fixed()) return;
    if (marched) {
      width_ = 1;  // no use in trying more before one step iterates again
    } else {
      width_ = NextWidth(width_, segment.steps, iterations);
    }
  }

  SolveContext& context_;
  const Problem& problem_;
  LcpBatch batch_;
  StepCache<StepTools> tools_;
  Vector x_;  // at the start of the next window
  Vector y_;
  Index width_ = 0;
  Index window_ = 0;
  bool started_ = false;
};

}  // namespace

bool LaplaceIteration(SolveContext& context) {
  context.solution.kernel.emplace();
  return Iteration(context).ReachEnd();
}

}  // namespace dlcs
