// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/splitting_iteration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/context/solve_context.h"
#include "core/discretization/scheme.h"
#include "core/iteration/window_control.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/nonlinear/blow_up.h"
#include "core/nonlinear/josephy_newton.h"
#include "core/nonlinear/nonlinear_step.h"
#include "core/nonlinear/window_sources.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

Matrix AddToCertificate(NonlinearFunctions& functions, const Scheme& scheme, const Matrix& W, const Segment& segment,
                        const std::vector<double>& times, Certificate& certificate) {
  Matrix values(segment.y.rows(), segment.steps + 1);
  Certificate& c = certificate;
  if (std::isnan(c.node_residual) && std::isnan(c.x_scale)) {
    c.node_residual = c.midpoint_residual = c.node_complementarity = c.midpoint_complementarity = 0;
    c.ode_defect = c.lcp_scale = c.ode_scale = c.x_scale = 0;
  }
  for (Index j = 0; j <= segment.steps; ++j) {
    LookForStop();
    const Vector x = segment.x.col(j), y = segment.y.col(j), w = functions.G(times[j], x, y);
    values.col(j) = w;
    c.node_residual = NanMax(c.node_residual, NaturalResidual(y, w));
    c.node_complementarity = NanMax(c.node_complementarity, std::abs(y.dot(w)));
    c.lcp_scale = NanMax(c.lcp_scale, NanMax(MaxAbs(y), MaxAbs(w)));
    c.ode_scale = NanMax(c.ode_scale, MaxAbs(functions.F(times[j], x, y)));
    c.x_scale = NanMax(c.x_scale, MaxAbs(x));
  }
  for (Index j = 0; j < segment.steps; ++j) {
    LookForStop();
    const double t = (times[j] + times[j + 1]) / 2;
    const Vector x = scheme.mid_state * segment.x.col(j) + scheme.mid_f_before * segment.f.col(j) +
                     scheme.mid_f_after * segment.f.col(j + 1);
    const Vector y = (segment.y.col(j) + segment.y.col(j + 1)) / 2;
    const Vector w = functions.G(t, x, y);
    const Vector slope = W * x + (segment.f.col(j) + segment.f.col(j + 1)) / 2;
    c.midpoint_residual = NanMax(c.midpoint_residual, NaturalResidual(y, w));
    c.midpoint_complementarity = NanMax(c.midpoint_complementarity, std::abs(y.dot(w)));
    c.ode_defect = NanMax(c.ode_defect, MaxAbs(slope - functions.F(t, x, y)));
  }
  return values;
}

Matrix ReducedJacobian(NonlinearFunctions& functions, double t, const Vector& x, const Vector& y) {
  const Matrix f_x = functions.FByX(t, x, y);
  const Vector w = functions.G(t, x, y);
  std::vector<Index> active;
  for (Index i = 0; i < y.size(); ++i) {
    if (y[i] > 0 && y[i] >= w[i]) active.push_back(i);
  }
  if (active.empty()) return f_x;
  const Matrix g_y = functions.GByY(t, x, y);
  const Eigen::PartialPivLU<Matrix> factor(Matrix(g_y(active, active)));
  if (!(factor.rcond() > 1e3 * std::numeric_limits<double>::epsilon())) return f_x;
  const Matrix g_x = functions.GByX(t, x, y);
  const Matrix f_y = functions.FByY(t, x, y);
  return f_x - f_y(Eigen::all, active) * factor.solve(Matrix(g_x(active, Eigen::all)));
}

namespace {

using Verdict = ComplementarityResult::Verdict;

class SplittingRun {
 public:
  explicit SplittingRun(NonlinearContext& context)
      : context_(context), problem_(context.problem), sources_(context), x_(problem_.x0), y_(context.y_guess) {}

  bool ReachEnd() {
    for (size_t r = 0; r < context_.grid.runs.size(); ++r) {
      const Run& run = context_.grid.runs[r];
      end_is_break_ = r + 1 < context_.grid.runs.size() && context_.grid.runs[r + 1].starts_at_break;
      if (run.starts_at_break && !StartInterval(run)) return false;
      for (Index done = 0; done < run.steps;) {
        const Index taken = Advance(run, done);
        if (taken == 0) return false;
        done += taken;
      }
    }
    return true;
  }

  std::string SplittingChoice() const {
    if (problem_.W) {
      return problem_.W->isZero(0) ? "splitting with W = 0 (Picard)" : "splitting with the W that was given";
    }
    return "splitting with W from the Jacobians at the start of windows, formed " + std::to_string(splittings_) +
           (splittings_ == 1 ? " time" : " times");
  }

 private:
  bool width_is_fixed() const { return context_.options.window_steps != 0; }
  Index max_iterations() const {
    if (context_.options.max_iterations > 0) return context_.options.max_iterations;
    return width_is_fixed() ? kMaxIterationsOfFixed : kMaxIterationsOfShrinking;
  }
  Index Width(const Run& run) const {
    const Index wanted = context_.options.window_steps;
    return wanted == Options::kWholeHorizon ? run.steps : wanted > 0 ? wanted : width_.value();
  }

  // The times of the nodes of a window, as formulas are to see them: at break points the limit from inside.
  std::vector<double> Times(const Run& run, Index done, Index steps) const {
    const auto first = context_.grid.times.begin() + run.first_node + done;
    std::vector<double> times(first, first + steps + 1);
    if (done == 0 && run.starts_at_break && run.begin > 0) times.front() = std::nextafter(times.front(), HUGE_VAL);
    if (done + steps == run.steps && end_is_break_) times.back() = std::nextafter(times.back(), 0);
    return times;
  }

  // y at the start of a smooth interval, where g may have jumped.
  bool StartInterval(const Run& run) {
    const double t = Times(run, 0, 1).front();
    JosephyNewton newton(context_.selection);
    const ComplementarityResult solved = SolveForY(context_.functions, newton, t, x_, y_);
    context_.solution.cost.lcps += solved.lcps;
    if (solved.verdict == Verdict::kSolved) return true;
    const SplittingOutcome failed = FailureOf(context_, solved, run.begin, x_, y_);
    return context_.Fail(failed.termination, run.begin, "No y at the start of a smooth interval: " + failed.why + ".");
  }

  // W and the scheme for steps from (t, x_, y_) on. A W that is accurate to a tenth is kept, and its matrix functions
  // with it.
  void PrepareScheme(double t, double step) {
    Matrix W = W_;
    if (problem_.W) {
      W = *problem_.W;
    } else {
      const Matrix wanted = ReducedJacobian(context_.functions, t, x_, y_);
      const bool keep = W_.size() > 0 && InfinityNorm(wanted - W_) <= 0.1 * InfinityNorm(W_);
      if (!wanted.allFinite()) {
        W = Matrix::Zero(x_.size(), x_.size());
      } else if (!keep) {
        W = wanted;
      }
    }
    if (W_.size() > 0 && scheme_.step == step && W == W_) return;
    splittings_ += W_.size() == 0 || W != W_;
    W_ = W;
    Problem linear;
    linear.A = W_;
    linear.B = Matrix::Zero(x_.size(), 0);
    scheme_ = ExponentialPiecewiseLinear(linear, step);
  }

  // Takes one window from step `done` of `run` on, shrinking it until it converges. Returns the steps taken; 0 when
  // the solve has ended.
  Index Advance(const Run& run, Index done) {
    PrepareScheme(Times(run, done, 1).front(), run.step);
    for (;;) {
      const Index steps = std::min(Width(run), run.steps - done);
      const std::vector<double> times = Times(run, done, steps);
      Segment segment;
      segment.first_node = run.first_node + done;
      segment.steps = steps;
      segment.step = run.step;
      const double begin = context_.grid.times[segment.first_node];
      const double end = context_.grid.times[segment.first_node + steps];
      context_.observer.OnWindowStarted({window_, begin, end, steps});
      SplittingOutcome result = Iterate(times, segment);
      const Index iterations = result.iterations;
      const bool couple = !result.converged && steps == 1 && !width_is_fixed() && !context_.stop.stop_requested();
      const std::string why = result.why;
      if (couple) result = Couple(times, segment);
      context_.observer.OnWindowFinished({window_, end, iterations, result.converged, couple, why});
      ++window_;
      ++context_.solution.cost.windows;
      if (context_.stop.stop_requested()) {
        context_.FailCancelled(begin);
        return 0;
      }
      if (result.converged) {
        Accept(times, segment);
        couple ? width_.AcceptCoupledStep() : width_.Accept(steps, iterations);
        return steps;
      }
      if (couple || width_is_fixed()) {
        if (const auto blow_up =
                FindBlowUp(context_.functions, context_.selection, times.front(), problem_.horizon, x_, y_)) {
          const std::string state = "x" + std::to_string(blow_up->state + 1);
          context_.Fail(Termination::kNonFinite, blow_up->time,
                        state + " grows without bound near t = " + FormatNumber(blow_up->time) + ", where it reaches " +
                            FormatNumber(blow_up->value) + ".");
          return 0;
        }
        context_.Fail(result.termination, result.time,
                      couple ? "The step to t = " + FormatNumber(end) + " failed: " + result.why + "."
                             : "The window [" + FormatNumber(begin) + ", " + FormatNumber(end) + "] failed after " +
                                   std::to_string(iterations) + " iterations: " + result.why +
                                   ". Automatic windows would shrink it.");
        return 0;
      }
      width_.Reject(steps);
    }
  }

  // The iteration on one window; leaves x, y and the sources of the last iterate in `segment`.
  SplittingOutcome Iterate(const std::vector<double>& times, Segment& segment) {
    const Index steps = segment.steps;
    segment.y = y_.replicate(1, steps + 1);
    segment.x = x_.replicate(1, steps + 1);
    const Vector start = context_.functions.F(times[0], x_, y_) - W_ * x_;
    segment.f = start.replicate(1, steps + 1);  // x^0: s frozen
    Propagate(segment);
    Vector size = RowMaxAbs(segment.x);
    std::vector<double> changes;
    SplittingOutcome result;
    result.time = context_.grid.times[segment.first_node];
    if (!start.allFinite()) {
      result.termination = Termination::kNonFinite;
      result.why = DescribeNonFinite("f", problem_.f, start, times[0]);
      return result;
    }
    while (result.iterations < max_iterations() && !context_.stop.stop_requested()) {
      const Index k = ++result.iterations;
      ++context_.solution.cost.iterations;
      const double lcp_begin = context_.Seconds();
      double residual = 0;
      const SplittingOutcome sources = sources_.Evaluate(times, W_, segment, residual);
      context_.solution.cost.seconds_lcp += context_.Seconds() - lcp_begin;
      if (!sources.converged) {
        result.termination = sources.termination;
        result.time = sources.time;
        result.why = "iterate " + std::to_string(k) + ": " + sources.why;
        return result;
      }
      const Matrix last = segment.x;
      Propagate(segment);
      const Vector row_change = RowMaxAbs(segment.x - last);
      size = size.cwiseMax(RowMaxAbs(segment.x));
      changes.push_back(RelativeChange(size, row_change));
      IterateReport report;
      report.window = window_, report.iteration = k;
      report.change = MaxAbs(row_change), report.lcp_residual = residual;
      report.seconds = context_.Seconds();
      context_.observer.OnIterate(report, {times, segment.y});
      result.converged = Converged(changes, context_.options.iteration_tolerance);
      if (result.converged) return result;
      if (!std::isfinite(changes.back()) || (!width_is_fixed() && Diverging(changes))) {
        result.termination = Termination::kDiverged;
        result.why = "the iterates diverge (x changed by " + FormatNumber(changes.back()) + " of its size)";
        return result;
      }
    }
    result.why = "the change of x is still " + FormatNumber(changes.empty() ? 0 : changes.back()) + " of its size";
    return result;
  }

  // The one step of `segment`, x and y together.
  SplittingOutcome Couple(const std::vector<double>& times, Segment& segment) {
    const Vector start = context_.functions.F(times[0], x_, y_) - W_ * x_;
    const Vector known = scheme_.state * x_ + scheme_.f_before * start;
    Vector x = x_, y = y_;
    const ComplementarityResult solved =
        SolveCoupledStep(context_.functions, times[1], known, scheme_.f_after, W_, x, y);
    context_.solution.cost.lcps += solved.lcps;
    if (solved.verdict != Verdict::kSolved) return FailureOf(context_, solved, times[1], x_, y_);
    if (context_.selection == Selection::kLeastElement) {
      Vector least = y;
      JosephyNewton newton(context_.selection);
      const bool found = SolveForY(context_.functions, newton, times[1], x, least).verdict == Verdict::kSolved;
      if (!found || MaxAbs(least - y) > 1e-8 * (1 + MaxAbs(y))) {
        return {.termination = Termination::kInfeasible,
                .time = times[1],
                .why = "x and y together have a solution, but its y is not the least element"};
      }
    }
    segment.x.col(1) = x;
    segment.y.col(1) = y;
    segment.f.col(1) = context_.functions.F(times[1], x, y) - W_ * x;
    ++context_.solution.cost.coupled_steps;
    return {.converged = true, .why = {}};
  }

  // Fills x of `segment` from its first column and the sources: the exp-PL recursion.
  void Propagate(Segment& segment) const {
    ForPanels(segment.steps, 3 * scheme_.state.size(), [&](Index begin, Index count) {
      auto x = segment.x.middleCols(begin + 1, count);
      x.noalias() = scheme_.f_before * segment.f.middleCols(begin, count);
      x.noalias() += scheme_.f_after * segment.f.middleCols(begin + 1, count);
      for (Index j = begin + 1; j <= begin + count; ++j) {
        segment.x.col(j).noalias() += scheme_.state * segment.x.col(j - 1);
      }
    });
  }

  void Accept(const std::vector<double>& times, const Segment& segment) {
    const Matrix w = AddToCertificate(context_.functions, scheme_, W_, segment, times, context_.solution.certificate);
    context_.recorder.Add(segment, w);
    context_.solution.cost.steps += segment.steps;
    x_ = segment.x.col(segment.steps);
    y_ = segment.y.col(segment.steps);
  }

  NonlinearContext& context_;
  const NonlinearProblem& problem_;
  WindowSources sources_;
  Matrix W_;
  Scheme scheme_;
  Index splittings_ = 0;  // how often W was formed
  Vector x_;              // at the start of the next window
  Vector y_;
  WindowWidth width_{kFirstWindow};
  Index window_ = 0;
  bool end_is_break_ = false;  // of the current run
};

}  // namespace

bool SplittingIteration(NonlinearContext& context) {
  SplittingRun run(context);
  const bool reached = run.ReachEnd();
  context.solution.reason += run.SplittingChoice();
  return reached;
}

}  // namespace dlcs
