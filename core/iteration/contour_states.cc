// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/contour_states.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/linalg/phi_functions.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;
using ComplexVector = Eigen::VectorXcd;

// With more nodes than this, the rounding of the contour of Remark 2.3 grows faster than its error falls.
constexpr Index kMaxInitialNodes = 13;
constexpr size_t kMaxTerms = 4;  // of a polynomial

// e^w, and ∫_0^h e^{z(h-τ)} (τ/h)^k dτ = h k! φ_{k+1}(w), w = zh: what a step does to the integral.
struct StepWeights {
  Complex decay;
  std::array<Complex, kMaxTerms> powers;
};

StepWeights WeightsOfStep(Complex z, double h, size_t terms) {
  const Complex w = z * h;
  StepWeights weights;
  weights.decay = std::exp(w);
  if (std::abs(w) < 2) {
    // k! φ_{k+1}(w) = Σ w^i k!/(k+1+i)!, the highest first, then φ_k = 1/k! + w φ_{k+1}: the recurrence upwards
    // cancels.
    Complex sum = 0, term = 1.0 / static_cast<double>(terms);
    for (size_t i = 1; sum + term != sum; ++i) {
      sum += term;
      term *= w / static_cast<double>(terms + i);
    }
    weights.powers[terms - 1] = h * sum;
    for (size_t k = terms - 1; k > 0; --k) {
      weights.powers[k - 1] = (h + w * weights.powers[k]) / static_cast<double>(k);
    }
    return weights;
  }
  weights.powers[0] = (weights.decay - 1.0) / z;
  for (size_t k = 1; k < terms; ++k) weights.powers[k] = (static_cast<double>(k) * weights.powers[k - 1] - h) / w;
  return weights;
}

// The same for a matrix: e^{hA}, then h k! φ_{k+1}(hA) for k < `terms`. The first row of the exponential of hA
// bordered by identities, [hA I; 0 0 I; ...], holds φ_0, φ_1, φ_2, ....
std::vector<Matrix> MatrixWeights(const Matrix& A, double h, size_t terms) {
  const Index k = A.rows();
  const auto blocks = static_cast<Index>(terms);
  Matrix bordered = Matrix::Zero((blocks + 1) * k, (blocks + 1) * k);
  bordered.topLeftCorner(k, k) = h * A;
  for (Index i = 0; i < blocks; ++i) bordered.block(i * k, (i + 1) * k, k, k).setIdentity();
  const Matrix exponential = ComputePhiFunctions(bordered).phi0;
  std::vector<Matrix> weights;
  double factor = h;
  for (Index i = 0; i <= blocks; ++i) {
    weights.push_back(exponential.block(0, i * k, k, k));
    if (i == 0) continue;
    weights.back() *= factor;
    factor *= static_cast<double>(i);
  }
  return weights;
}

size_t Terms(Interpolation interpolation) { return interpolation == Interpolation::kLinear ? 2 : 4; }

}  // namespace

ContourStates::ContourStates(SolveContext& context, const Contour& contour, const SpectrumSplit& split)
    : context_(context), columns_(context.grid), num_nodes_(contour.nodes), split_(split) {
  if (split.separated() < context.problem.num_states()) nodes_ = Nodes(contour);
  PrepareInitialResponse();
  if (split.separated() > 0) PrepareSeparatedPart();
}

void ContourStates::PrepareInitialResponse() {
  initial_.resize(context_.problem.num_states(), columns_.CountAll());
  const Contour contour = InitialStateContour(std::min(num_nodes_, kMaxInitialNodes));
  const double sector = SectorAngle(split_.inside.Eigenvalues());
  const bool fits = split_.separated() == 0 && sector < std::numbers::pi / 2 - contour.gamma;
  if (context_.options.contour_for_initial_state && fits) return InitialResponseByContour(contour);
  if (context_.options.contour_for_initial_state) {
    context_.solution.warnings.push_back(
        "The sector of the spectrum is too wide for the contour of Remark 2.3: e^{At} x0 comes from matrix "
        "exponentials.");
  }
  InitialResponseByExponentials();
}

void ContourStates::InitialResponseByExponentials() {
  Vector x = context_.problem.x0;
  for (size_t r = 0; r < context_.grid.runs.size(); ++r) {
    const Run& run = context_.grid.runs[r];
    const Matrix step = ComputePhiFunctions(run.step * context_.problem.A.Dense()).phi0;
    initial_.col(columns_.First(r)) = x;
    for (Index k = 1; k <= run.steps; ++k) {
      LookForStop();
      initial_.col(columns_.Of(r, k)) = x = (step * x).eval();
    }
  }
}

void ContourStates::InitialResponseByContour(const Contour& contour) {
  const std::vector<ContourNode> nodes = Nodes(contour);
  const ComplexVector x0 = split_.inside.ToSchur(context_.problem.x0.cast<Complex>());
  for (size_t r = 0; r < context_.grid.runs.size(); ++r) {
    const Run& run = context_.grid.runs[r];
    context_.workers.ForBlocks(run.steps + 1, 1, [&](Index, Index k, Index) {
      const double t = context_.grid.times[run.first_node + k];
      if (t == 0) {
        initial_.col(columns_.Of(r, k)) = context_.problem.x0;
        return;
      }
      ComplexVector sum = ComplexVector::Zero(x0.size());
      for (const ContourNode& node : nodes) {
        ComplexVector term = x0;
        split_.inside.Solve(node.z / t, term);
        sum += node.weight / t * std::exp(node.z) * term;
      }
      initial_.col(columns_.Of(r, k)) = split_.inside.FromSchur(sum);
    });
  }
}

void ContourStates::PrepareSeparatedPart() {
  const std::vector<Run>& runs = context_.grid.runs;
  for (size_t r = 0; r < runs.size(); ++r) {
    const bool same = r > 0 && runs[r].step == runs[r - 1].step;
    separated_steps_.push_back(
        same ? separated_steps_.back()
             : MatrixWeights(split_.outside, runs[r].step, Terms(context_.options.interpolation)));
  }
}

Matrix ContourStates::Solve(const Matrix& sources) const {
  const std::vector<InterpolatedRun> pieces = Interpolate(context_.options.interpolation, context_.grid, sources);
  Matrix x = initial_;
  if (!nodes_.empty()) AddContourPart(pieces, x);
  if (split_.separated() > 0) AddSeparatedPart(pieces, x);
  return x;
}

void ContourStates::AddContourPart(const std::vector<InterpolatedRun>& sources, Matrix& x) const {
  // Times in batches, so that the terms of all contour nodes fit in memory; within a batch every (time, node) is
  // a task, and the terms of a time are summed in the order of its nodes.
  constexpr Index kTimesPerBatch = 64;
  const Index terms = static_cast<Index>(nodes_.size());
  const Index count = context_.grid.num_steps();
  Eigen::MatrixXcd contributions(split_.inside.T().rows(), kTimesPerBatch * terms);
  for (Index first = 1; first <= count; first += kTimesPerBatch) {
    if (context_.stop.stop_requested()) return;
    const Index times = std::min(kTimesPerBatch, count - first + 1);
    context_.workers.ForBlocks(times * terms, 1, [&](Index, Index item, Index) {
      if (context_.stop.stop_requested()) return;
      contributions.col(item) = Contribution(sources, first + item / terms, nodes_[item % terms]);
    });
    context_.workers.ForBlocks(times, 1, [&](Index, Index k, Index) {
      ComplexVector sum = contributions.col(k * terms);
      for (Index p = 1; p < terms; ++p) sum += contributions.col(k * terms + p);
      const Vector value = split_.inside.FromSchur(sum);
      for (size_t r = 0; r < sources.size(); ++r) {
        const Index step = first + k - context_.grid.runs[r].first_node;
        if (step >= 0 && step <= context_.grid.runs[r].steps) x.col(columns_.Of(r, step)) += value;
      }
    });
  }
}

ComplexVector ContourStates::Contribution(const std::vector<InterpolatedRun>& sources, Index node_index,
                                          const ContourNode& node) const {
  const double t = context_.grid.times[node_index];
  const Complex z = node.z / t;
  ComplexVector integral = ComplexVector::Zero(context_.problem.num_states());
  for (size_t r = 0; r < sources.size(); ++r) {
    const Run& run = context_.grid.runs[r];
    const Index steps = std::min(run.steps, node_index - run.first_node);
    if (steps <= 0) break;
    const std::vector<Matrix>& coefficients = sources[r].coefficients;
    const StepWeights weights = WeightsOfStep(z, run.step, coefficients.size());
    LookForStop();
    for (Index l = 0; l < steps; ++l) {
      integral *= weights.decay;
      for (size_t k = 0; k < coefficients.size(); ++k) integral += weights.powers[k] * coefficients[k].col(l);
    }
  }
  ComplexVector term = split_.inside.ToSchur(integral);
  split_.inside.Solve(z, term);
  return node.weight / t * term;
}

void ContourStates::AddSeparatedPart(const std::vector<InterpolatedRun>& sources, Matrix& x) const {
  Vector part = Vector::Zero(split_.separated());
  for (size_t r = 0; r < sources.size(); ++r) {
    const std::vector<Matrix>& step = separated_steps_[r];
    const std::vector<Matrix>& coefficients = sources[r].coefficients;
    x.col(columns_.First(r)) += split_.basis * part;
    for (Index l = 0; l < context_.grid.runs[r].steps; ++l) {
      LookForStop();
      part = (step[0] * part).eval();
      for (size_t k = 0; k < coefficients.size(); ++k) part += step[k + 1] * (split_.left * coefficients[k].col(l));
      x.col(columns_.Of(r, l + 1)) += split_.basis * part;
    }
  }
}

}  // namespace dlcs
