// SPDX-License-Identifier: Apache-2.0

#include "core/methods/paper_iteration.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/analysis/laplace_bounds.h"
#include "core/laplace/contour.h"
#include "core/laplace/contour_choice.h"
#include "core/laplace/resolvent.h"
#include "core/lcp/batch.h"
#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "core/methods/scheme.h"
#include "core/methods/steep_step.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;
using ComplexVector = Eigen::VectorXcd;

// Beyond this many nodes the rounding of Remark 2.3's contour grows faster than its error falls.
constexpr Index kMostInitialNodes = 13;

// The weights of a source linear over a step of length h under e^{z(t-τ)}: with w = zh,
// h(φ_1 - φ_2)(w) at its begin and h φ_2(w) at its end, and e^w.
struct StepWeights {
  Complex decay, before, after;
};

StepWeights WeightsOfStep(Complex z, double h) {
  const Complex w = z * h;
  Complex phi1, phi2;
  if (std::abs(w) < 1) {
    // φ_2(w) = Σ w^k/(k+2)!: the closed form below cancels.
    phi2 = 0;
    Complex term = 0.5;
    for (int k = 0; std::abs(term) > 1e-18; ++k) {
      phi2 += term;
      term *= w / static_cast<double>(k + 3);
    }
    phi1 = 1.0 + w * phi2;
  } else {
    phi1 = (std::exp(w) - 1.0) / w;
    phi2 = (phi1 - 1.0) / w;
  }
  return {std::exp(w), h * (phi1 - phi2), h * phi2};
}

class Iteration {
 public:
  Iteration(SolveContext& context, Contour contour, const Resolvent& resolvent)
      : context_(context),
        problem_(context.problem),
        contour_(contour),
        nodes_(Nodes(contour)),
        resolvent_(resolvent),
        batch_(problem_.M, context.selection, problem_.selector) {}

  bool ReachEnd() {
    const double horizon = problem_.horizon;
    if (!Prepare()) return false;
    IterationBound bound = Bound();
    context_.observer.OnWindowStarted({0, 0, horizon, context_.grid.num_steps()});
    context_.solution.cost.windows = 1;

    const Index limit = context_.options.max_iterations > 0 ? context_.options.max_iterations : 1000;
    double first_change = 0, last_change = 0;
    for (Index k = 1; k <= limit; ++k) {
      ++context_.solution.cost.iterations;
      if (!SolveLcps(k)) return false;
      const Matrix next = SolveStates();
      if (context_.stop.stop_requested()) return context_.FailCancelled(0);
      const double change = MaxAbs(next - x_);
      const double size = MaxAbs(next);
      x_ = next;

      if (k == 1) first_change = change;
      Report(k, change, bound.LogFactor(static_cast<int>(k - 1)) + std::log(first_change));
      if (!std::isfinite(change)) {
        return context_.Fail(Termination::kDiverged, horizon,
                             "The iterates grew beyond the range of numbers. The whole horizon is one window "
                             "here; laplace-iteration takes shorter ones.");
      }
      const double contraction = k > 1 ? change / last_change : 1;
      const double tolerance = context_.options.tolerance * size;
      const bool rounding = change <= 1e-14 * size;
      if (rounding || (k > 1 && contraction < 1 &&
                       std::max(change, change * contraction / (1 - contraction)) <= tolerance)) {
        return Accept(k);
      }
      last_change = change;
    }
    return context_.Fail(Termination::kIterationLimit, horizon,
                         "After " + std::to_string(limit) + " iterations the change is still " +
                             FormatNumber(last_change) + ".");
  }

 private:
  // Break points are two columns, one for each limit; x is the same in both.
  Index Column(size_t run, Index step) const {
    return context_.grid.runs[run].first_node + static_cast<Index>(run) + step;
  }

  bool Prepare() {
    const Grid& grid = context_.grid;
    const Index columns = Column(grid.runs.size() - 1, grid.runs.back().steps) + 1;
    segments_.resize(grid.runs.size());
    x_ = problem_.x0.replicate(1, columns);
    g_.resize(problem_.num_constraints(), columns);
    y_ = Matrix::Zero(problem_.num_constraints(), columns);
    for (size_t r = 0; r < grid.runs.size(); ++r) {
      const Run& run = grid.runs[r];
      if (const auto bad = context_.sources.Sample(grid, run, 0, run.steps, segments_[r])) {
        return context_.FailNonFinite(*bad);
      }
      g_.middleCols(Column(r, 0), run.steps + 1) = segments_[r].g;
    }
    PrepareInitialResponse(columns);
    return true;
  }

  // e^{At} x0 for all columns: by one matrix exponential a step length, or by Remark 2.3's contour.
  void PrepareInitialResponse(Index columns) {
    initial_.resize(problem_.num_states(), columns);
    const Grid& grid = context_.grid;
    const Contour contour = InitialStateContour(std::min(contour_.nodes, kMostInitialNodes));
    const bool fits = SectorAngle(resolvent_.Eigenvalues()) < std::numbers::pi / 2 - contour.gamma;
    if (context_.options.contour_for_initial_state && !fits) {
      context_.solution.warnings.push_back(
          "The sector of the spectrum is too wide for the contour of Remark 2.3: e^{At} x0 comes from matrix exponentials.");
    }
    if (!context_.options.contour_for_initial_state || !fits) {
      Vector x = problem_.x0;
      for (size_t r = 0; r < grid.runs.size(); ++r) {
        const Matrix step = ComputePhiFunctions(grid.runs[r].step * problem_.A).phi0;
        initial_.col(Column(r, 0)) = x;
        for (Index k = 1; k <= grid.runs[r].steps; ++k) initial_.col(Column(r, k)) = x = (step * x).eval();
      }
      return;
    }
    const std::vector<ContourNode> nodes = Nodes(contour);
    const ComplexVector x0 = resolvent_.ToSchur(problem_.x0.cast<Complex>());
    for (size_t r = 0; r < grid.runs.size(); ++r) {
      const Run& run = grid.runs[r];
      context_.workers.ForBlocks(run.steps + 1, 1, [&](Index, Index k, Index) {
        const double t = grid.times[run.first_node + k];
        if (t == 0) {
          initial_.col(Column(r, k)) = problem_.x0;
          return;
        }
        ComplexVector sum = ComplexVector::Zero(x0.size());
        for (const ContourNode& node : nodes) {
          ComplexVector term = x0;
          resolvent_.Solve(node.z / t, term);
          sum += node.weight / t * std::exp(node.z) * term;
        }
        initial_.col(Column(r, k)) = resolvent_.FromSchur(sum);
      });
    }
  }

  // y^{k} = SOL(N x^{k-1} + g, M) at all columns.
  bool SolveLcps(Index k) {
    const double begin = context_.Seconds();
    Matrix q = g_;
    q.noalias() += problem_.N * x_;
    const Vector size = SizeOfSums(problem_.N, x_, g_);
    const LcpBatchOutcome outcome = batch_.Solve(q, kLcpTolerance * size, context_.workers, context_.stop, y_);
    context_.solution.cost.lcps += q.cols();
    context_.solution.cost.seconds_lcp += context_.Seconds() - begin;
    if (outcome.cancelled) return context_.FailCancelled(0);
    if (outcome.verdict == LcpVerdict::kSolved) return KeepsToSlope(q);
    const double t = TimeOfColumn(outcome.column);
    if (k == 1 || outcome.verdict == LcpVerdict::kNonFinite) {
      return FailLcp(context_, outcome.verdict, t, "LCP(N x0 + g, M), the first iterate's,");
    }
    return context_.Fail(Termination::kDiverged, t,
                         "Iterate " + std::to_string(k) + " left the feasible set at t = " + FormatNumber(t) +
                             " (" + LcpVerdictName(outcome.verdict) +
                             "). The whole horizon is one window here; laplace-iteration takes shorter ones.");
  }

  // Ends the solve where y may jump and does, between two columns of one run.
  bool KeepsToSlope(const Matrix& q) {
    if (!context_.largest_slope) return true;
    for (size_t r = 0; r < segments_.size(); ++r) {
      const Index first = Column(r, 0), count = context_.grid.runs[r].steps + 1;
      const auto jump = FindSteepStep(q.middleCols(first, count), y_.middleCols(first, count), *context_.largest_slope);
      if (!jump) continue;
      const double t = TimeOfColumn(first + jump->column);
      return context_.FailJump(t, DescribeSteepStep(*jump, t, *context_.largest_slope));
    }
    return true;
  }

  // The states of the next iterate, for the sources B ỹ + f̃ of the current one.
  Matrix SolveStates() {
    const double begin = context_.Seconds();
    const Grid& grid = context_.grid;
    for (size_t r = 0; r < grid.runs.size(); ++r) {
      segments_[r].x = segments_[r].f;
      segments_[r].x.noalias() += problem_.B * y_.middleCols(Column(r, 0), grid.runs[r].steps + 1);
    }

    // Times in batches, so that the terms of all contour nodes fit in memory; within a batch every (time, node) is
    // a task, and the terms of a time are summed in the order of its nodes.
    constexpr Index kTimesPerBatch = 64;
    const Index terms = static_cast<Index>(nodes_.size());
    const Index count = grid.num_steps();
    Matrix next = initial_;
    Eigen::MatrixXcd contributions(problem_.num_states(), kTimesPerBatch * terms);
    for (Index first = 1; first <= count; first += kTimesPerBatch) {
      if (context_.stop.stop_requested()) break;
      const Index times = std::min(kTimesPerBatch, count - first + 1);
      context_.workers.ForBlocks(times * terms, 1, [&](Index, Index item, Index) {
        if (context_.stop.stop_requested()) return;
        contributions.col(item) = Contribution(first + item / terms, nodes_[item % terms]);
      });
      context_.workers.ForBlocks(times, 1, [&](Index, Index k, Index) {
        ComplexVector sum = contributions.col(k * terms);
        for (Index p = 1; p < terms; ++p) sum += contributions.col(k * terms + p);
        AddToColumns(first + k, resolvent_.FromSchur(sum), next);
      });
    }
    context_.solution.cost.seconds_linear += context_.Seconds() - begin;
    return next;
  }

  // weight · (zI - A)⁻¹ ∫_0^t e^{z(t-τ)} s̃(τ) dτ at node `node_index` of the grid, in Schur coordinates.
  ComplexVector Contribution(Index node_index, const ContourNode& node) const {
    const double t = context_.grid.times[node_index];
    const Complex z = node.z / t;
    ComplexVector integral = ComplexVector::Zero(problem_.num_states());
    for (size_t r = 0; r < segments_.size(); ++r) {
      const Run& run = context_.grid.runs[r];
      const Index steps = std::min(run.steps, node_index - run.first_node);
      if (steps <= 0) break;
      const StepWeights weights = WeightsOfStep(z, run.step);
      const Matrix& source = segments_[r].x;
      for (Index l = 0; l < steps; ++l) {
        integral = weights.decay * integral + weights.before * source.col(l).cast<Complex>() +
                   weights.after * source.col(l + 1).cast<Complex>();
      }
    }
    ComplexVector term = resolvent_.ToSchur(integral);
    resolvent_.Solve(z, term);
    return node.weight / t * term;
  }

  void AddToColumns(Index node_index, const Vector& value, Matrix& next) const {
    for (size_t r = 0; r < segments_.size(); ++r) {
      const Run& run = context_.grid.runs[r];
      const Index step = node_index - run.first_node;
      if (step >= 0 && step <= run.steps) next.col(Column(r, step)) += value;
    }
  }

  double TimeOfColumn(Index column) const {
    size_t r = segments_.size() - 1;
    while (r > 0 && column < Column(r, 0)) --r;
    return context_.grid.times[context_.grid.runs[r].first_node + column - Column(r, 0)];
  }

  // (2.7a), with φ of up to 32 of the times; its factors are NaN where L is not known.
  IterationBound Bound() const {
    constexpr Index kSampledTimes = 32;
    const Index count = context_.grid.num_steps();
    std::vector<double> times;
    for (Index k = 1; k <= count; k += std::max<Index>(1, count / kSampledTimes)) times.push_back(context_.grid.times[k]);
    double rate = std::numeric_limits<double>::quiet_NaN();
    if (const auto lipschitz = context_.matrix_class.lipschitz) {
      rate = IterationRate(contour_, ResolventFactor(contour_, resolvent_, times), *lipschitz, problem_);
    }
    return IterationBound(contour_, rate, problem_.horizon);
  }

  void Report(Index k, double change, double log_bound) {
    IterateReport report;
    report.iteration = k;
    report.change = change;
    Matrix w = g_;
    w.noalias() += problem_.N * x_;
    w.noalias() += problem_.M * y_;
    report.lcp_residual = NaturalResidual(y_, w);
    if (std::isfinite(log_bound)) report.log10_bound = log_bound / std::log(10.0);
    report.seconds = context_.Seconds();
    context_.observer.OnIterate(report);
  }

  bool Accept(Index iterations) {
    const Grid& grid = context_.grid;
    context_.observer.OnWindowFinished({0, problem_.horizon, iterations, true, false, {}});
    context_.solution.cost.steps = grid.num_steps();
    for (size_t r = 0; r < grid.runs.size(); ++r) {
      segments_[r].x = x_.middleCols(Column(r, 0), grid.runs[r].steps + 1);
      segments_[r].y = y_.middleCols(Column(r, 0), grid.runs[r].steps + 1);
      context_.Add(segments_[r], ExponentialPiecewiseLinear(problem_, grid.runs[r].step));
    }
    return true;
  }

  SolveContext& context_;
  const Problem& problem_;
  Contour contour_;
  std::vector<ContourNode> nodes_;
  const Resolvent& resolvent_;
  LcpBatch batch_;
  std::vector<Segment> segments_;  // by run; x holds the source B ỹ + f̃ while iterating
  Matrix initial_;                 // e^{At} x0
  Matrix x_, y_, g_;
};

}  // namespace

bool PaperIteration(SolveContext& context) {
  const Resolvent resolvent(context.problem.A);
  const double angle = SectorAngle(resolvent.Eigenvalues());
  const Contour contour = ContourFor(context.options, angle);
  const double allowed = std::numbers::pi / 2 - contour.gamma;
  if (!(angle < allowed)) {
    return context.Fail(Termination::kUnsupported, std::numeric_limits<double>::quiet_NaN(),
                        "The spectrum of A leaves the sector of the contour: max |arg(-λ)| = " + FormatNumber(angle) +
                            ", and π/2 - γ = " + FormatNumber(allowed) +
                            " must be larger. laplace-iteration takes any A.");
  }
  if (!(angle < std::numbers::pi / 2 - SourceContour(contour.nodes).gamma)) {
    context.solution.warnings.push_back(
        "The sector of the spectrum is too wide for the contour of Theorem 2.2 (max |arg(-λ)| = " + FormatNumber(angle) +
        "). Remark 2.4 gives another one (γ = " + FormatNumber(contour.gamma) + ", μ = " + FormatNumber(contour.mu) +
        ", Δv = " + FormatNumber(contour.step) + ") with a quadrature error of some " +
        FormatNumber(std::exp(LogSourceError(contour, angle))) + " at P = " + std::to_string(contour.nodes) + ".");
  }
  return Iteration(context, contour, resolvent).ReachEnd();
}

}  // namespace dlcs
