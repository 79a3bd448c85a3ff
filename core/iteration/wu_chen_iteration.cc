// SPDX-License-Identifier: Apache-2.0

#include "core/iteration/wu_chen_iteration.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/discretization/grid.h"
#include "core/discretization/scheme.h"
#include "core/iteration/contour_states.h"
#include "core/iteration/jump_test.h"
#include "core/laplace/contour.h"
#include "core/laplace/contour_choice.h"
#include "core/laplace/iteration_bounds.h"
#include "core/laplace/spectrum_split.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/batch.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"

namespace dlcs {
namespace {

// A convergent iteration may grow first, like (Lt)^k/k!. What grows by more than this loses the digits that remain.
constexpr double kMaxGrowth = 1e10;
// One that grows by less is back where it began after this many iterations: Lt = ln 1e10 = 23, and (Lt)^k/k! = 1 at k =
// 60.
constexpr Index kMaxInVain = 100;

class PlainIteration {
 public:
  PlainIteration(SolveContext& context, const Contour& contour, const SpectrumSplit& split)
      : context_(context),
        problem_(context.problem),
        contour_(contour),
        split_(split),
        columns_(context.grid),
        batch_(problem_.M, context.choice()) {}

  bool ReachEnd() {
    const double horizon = problem_.horizon;
    if (!Prepare()) return false;
    IterationBound bound = Bound();
    context_.observer.OnWindowStarted({0, 0, horizon, context_.grid.num_steps()});
    context_.solution.cost.windows = 1;

    const Index limit = context_.options.max_iterations > 0 ? context_.options.max_iterations : 1000;
    double first_change = 0, last_change = 0, first_size = 0;
    double least_change = std::numeric_limits<double>::infinity();
    Index iteration_of_least = 0;
    for (Index k = 1; k <= limit; ++k) {
      ++context_.solution.cost.iterations;
      if (!SolveLcps(k)) return false;
      const Matrix next = SolveStates();
      if (context_.stop.stop_requested()) return context_.FailCancelled(0);
      const double change = MaxAbs(next - x_);
      const double size = MaxAbs(next);
      x_ = next;

      if (k == 1) first_change = change;
      if (k == 1) first_size = size;
      if (change < least_change) {
        least_change = change;
        iteration_of_least = k;
      }
      Report(k, change, bound.LogFactor(static_cast<int>(k - 1)) + std::log(first_change));
      if (!std::isfinite(change)) {
        return context_.Fail(Termination::kDiverged, horizon,
                             "The iterates grew beyond the range of numbers. The whole horizon is one window "
                             "here; laplace-iteration takes shorter ones.");
      }
      if (change > kMaxGrowth * first_size) {
        return context_.Fail(Termination::kDiverged, horizon,
                             "The iterates grew to " + FormatNumber(change) + " from " + FormatNumber(first_size) +
                                 ": even if they decrease again, rounding has destroyed the limit. The "
                                 "whole horizon is one window here; laplace-iteration takes shorter ones.");
      }
      if (k - iteration_of_least >= kMaxInVain) {
        Keep();
        return context_.Fail(
            Termination::kIterationLimit, horizon,
            "The change has not fallen below " + FormatNumber(least_change) + " for " + std::to_string(kMaxInVain) +
                " iterations; the trajectory is the last iterate. The whole horizon is one window here; "
                "laplace-iteration takes shorter ones.");
      }
      const double contraction = k > 1 ? change / last_change : 1;
      const double tolerance = context_.options.iteration_tolerance * size;
      const bool rounding = change <= kRowRounding * size;
      if (rounding ||
          (k > 1 && contraction < 1 && std::max(change, change * contraction / (1 - contraction)) <= tolerance)) {
        return Accept(k);
      }
      last_change = change;
    }
    Keep();
    return context_.Fail(Termination::kIterationLimit, horizon,
                         "After " + std::to_string(limit) + " iterations the change is still " +
                             FormatNumber(last_change) + "; the trajectory is the last iterate.");
  }

 private:
  bool Prepare() {
    const Grid& grid = context_.grid;
    segments_.resize(grid.runs.size());
    for (Index k = 0; k < columns_.CountAll(); ++k) times_.push_back(columns_.Time(k));
    x_ = problem_.x0.replicate(1, columns_.CountAll());
    f_.resize(problem_.num_states(), columns_.CountAll());
    g_.resize(problem_.num_constraints(), columns_.CountAll());
    y_ = Matrix::Zero(problem_.num_constraints(), columns_.CountAll());
    for (size_t r = 0; r < grid.runs.size(); ++r) {
      if (const auto bad = context_.sources.Sample(grid, grid.runs[r], 0, grid.runs[r].steps, segments_[r])) {
        return context_.FailNonFinite(*bad);
      }
      f_.middleCols(columns_.First(r), columns_.Count(r)) = segments_[r].f;
      g_.middleCols(columns_.First(r), columns_.Count(r)) = segments_[r].g;
    }
    states_.emplace(context_, contour_, split_);
    return true;
  }

  // y^{k} = SOL(N x^{k-1} + g, M) at all columns.
  bool SolveLcps(Index k) {
    const double begin = context_.Seconds();
    Matrix q = g_;
    AddProduct(problem_.N, problem_.N.size(), x_, q);
    const Vector size = SizeOfSums(problem_.N, x_, g_);
    const LcpBatchOutcome outcome = batch_.Solve(q, kLcpTolerance * size, context_.workers, context_.stop, y_);
    context_.solution.cost.lcps += q.cols();
    context_.solution.cost.seconds_lcp += context_.Seconds() - begin;
    if (outcome.cancelled) return context_.FailCancelled(0);
    if (outcome.verdict == LcpStatus::kSolved) return KeepsToSlope(q);
    const double t = columns_.Time(outcome.column);
    if (k == 1 || outcome.verdict == LcpStatus::kNonFinite) {
      return FailLcp(context_, outcome.verdict, t, "LCP(N x0 + g, M), the first iterate's,");
    }
    return context_.Fail(Termination::kDiverged, t,
                         "Iterate " + std::to_string(k) + " left the feasible set at t = " + FormatNumber(t) + " (" +
                             LcpStatusName(outcome.verdict) +
                             "). The whole horizon is one window here; laplace-iteration takes shorter ones.");
  }

  // Ends the solve if y may jump and does jump between two columns of one run.
  bool KeepsToSlope(const Matrix& q) {
    if (!context_.choices.largest_slope) return true;
    for (size_t r = 0; r < segments_.size(); ++r) {
      const Index first = columns_.First(r), count = columns_.Count(r);
      const auto jump =
          DetectJump(q.middleCols(first, count), y_.middleCols(first, count), *context_.choices.largest_slope);
      if (!jump) continue;
      const double t = columns_.Time(first + jump->column);
      return context_.FailJump(t, DescribeJump(*jump, t, *context_.choices.largest_slope));
    }
    return true;
  }

  // The states of the next iterate, for the sources B ỹ + f̃ of the current one.
  Matrix SolveStates() {
    const double begin = context_.Seconds();
    Matrix sources = f_;
    AddProduct(problem_.B, problem_.B.size(), y_, sources);
    Matrix next = states_->Solve(sources);
    context_.solution.cost.seconds_linear += context_.Seconds() - begin;
    return next;
  }

  // The bound (2.7a), with φ at up to 32 of the times. Its factors are NaN if L is not known or the theorem does not
  // hold: eigenvalues outside the sector have no φ, and a spline can exceed the values that it interpolates.
  IterationBound Bound() const {
    constexpr Index kSampledTimes = 32;
    const Index count = context_.grid.num_steps();
    std::vector<double> times;
    for (Index k = 1; k <= count; k += std::max<Index>(1, count / kSampledTimes)) {
      times.push_back(context_.grid.times[k]);
    }
    double rate = std::numeric_limits<double>::quiet_NaN();
    const auto lipschitz = context_.matrix_class.lipschitz;
    const bool linear = context_.options.interpolation == Interpolation::kLinear;
    if (lipschitz && linear && split_.separated() == 0) {
      const double factor = ResolventFactor(contour_, split_.inside, times, context_.stop);
      rate = IterationRate(contour_, factor, *lipschitz, problem_);
    }
    return IterationBound(contour_, rate, problem_.horizon);
  }

  void Report(Index k, double change, double log_bound) {
    IterateReport report;
    report.iteration = k;
    report.change = change;
    Matrix w = g_;
    AddProduct(problem_.N, problem_.N.size(), x_, w);
    AddProduct(problem_.M, problem_.M.size(), y_, w);
    report.lcp_residual = NaturalResidual(y_, w);
    if (std::isfinite(log_bound)) report.log10_bound = log_bound / std::log(10.0);
    report.seconds = context_.Seconds();
    context_.observer.OnIterate(report, {times_, y_});
  }

  bool Accept(Index iterations) {
    context_.observer.OnWindowFinished({0, problem_.horizon, iterations, true, false, {}});
    Keep();
    return true;
  }

  // The iterate as the trajectory.
  void Keep() {
    const Grid& grid = context_.grid;
    context_.solution.cost.steps = grid.num_steps();
    for (size_t r = 0; r < grid.runs.size(); ++r) {
      segments_[r].x = x_.middleCols(columns_.First(r), columns_.Count(r));
      segments_[r].y = y_.middleCols(columns_.First(r), columns_.Count(r));
      context_.Add(segments_[r], ExponentialPiecewiseLinear(problem_, grid.runs[r].step));
    }
  }

  SolveContext& context_;
  const Problem& problem_;
  Contour contour_;
  const SpectrumSplit& split_;
  NodeColumns columns_;
  LcpBatch batch_;
  std::optional<ContourStates> states_;
  std::vector<Segment> segments_;  // by run
  std::vector<double> times_;      // of the columns
  Matrix x_, y_, f_, g_;           // at the columns
};

// Returns the bound below which eigenvalues count as zero: every contour encloses them at any time. Contours meet the
// real axis some hundred times as far out, so that a factor of 4 does not matter.
double Enclosed(const SolveContext& context) { return 1e-3 / context.problem.horizon; }

SpectrumSplit SplitForContour(const SolveContext& context) {
  const double widest = WidestSector(context.options);
  const double enclosed = Enclosed(context);
  return SplitSpectrum(context.problem.A, [&](std::complex<double> lambda) {
    return context.choices.without_contours || (std::abs(lambda) > enclosed && !(std::abs(std::arg(-lambda)) < widest));
  });
}

void Record(const Contour& contour, double angle, const SpectrumSplit& split, SolveContext& context) {
  ContourRecord& record = context.solution.contour.emplace();
  record.separated = split.separated();
  if (split.separated() < context.problem.num_states()) {
    record.nodes = contour.nodes;
    record.gamma = contour.gamma;
    record.mu = contour.mu;
    record.step = contour.step;
    record.choice = ContourSource(context.options, angle);
    record.sector_angle = angle;
    record.log10_error = LogSourceError(contour, angle) / std::log(10.0);
  }
  if (record.choice == "Remark 2.4" && context.options.contour == ContourChoice::kAuto) {
    context.solution.warnings.push_back(
        "The sector of the spectrum is too wide for the contour of Theorem 2.2 (max |arg(-λ)| = " +
        FormatNumber(angle) + "). Remark 2.4 gives another one (γ = " + FormatNumber(contour.gamma) + ", μ = " +
        FormatNumber(contour.mu) + ", Δv = " + FormatNumber(contour.step) + ") with a quadrature error of some " +
        FormatNumber(std::exp(LogSourceError(contour, angle))) + " at P = " + std::to_string(contour.nodes) + ".");
  }
  if (split.separated() > 0) {
    const bool ill_conditioned = record.nodes == 0 && split.condition > kWorstCondition;
    context.solution.warnings.push_back(
        std::to_string(split.separated()) + " of " + std::to_string(context.problem.num_states()) +
        (ill_conditioned
             ? std::string(" eigenvalues of A are integrated by φ-functions, not by a contour: some lie outside every "
                           "sector that a contour can have, and too close to the others to be separated.")
             : " eigenvalues of A lie outside the sector |arg(-λ)| < " + FormatNumber(WidestSector(context.options)) +
                   " of the contour. Their subspace is integrated by φ-functions; the circles of Remark 2.1 "
                   "would count e^{λt} twice for small t."));
  }
}

}  // namespace

bool WuChenIteration(SolveContext& context) {
  const SpectrumSplit split = SplitForContour(context);
  const double angle = SectorAngle(split.inside.Eigenvalues(), Enclosed(context));
  const Contour contour = ContourFor(context.options, angle);
  Record(contour, angle, split, context);
  return PlainIteration(context, contour, split).ReachEnd();
}

}  // namespace dlcs
