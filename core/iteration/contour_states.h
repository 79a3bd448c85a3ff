// SPDX-License-Identifier: Apache-2.0
// Computes the states from given sources, with a different contour for each time.

#ifndef DLCS_CORE_ITERATION_CONTOUR_STATES_H_
#define DLCS_CORE_ITERATION_CONTOUR_STATES_H_

#include <vector>

#include "core/context/solve_context.h"
#include "core/discretization/grid.h"
#include "core/iteration/interpolation.h"
#include "core/laplace/contour.h"
#include "core/laplace/spectrum_split.h"

namespace dlcs {

// The second line of (2.17) of [Wu & Chen],
//
//     x_j = e^{A t_j} x0 + Δv/(2πi) Σ_{p=-P..P} z'_p (z_p I - A)⁻¹ ∫_0^{t_j} e^{z_p (t_j - τ)} s̃(τ) dτ,
//
// at all nodes, the integral taken exactly for the interpolant s̃ of the sources. Eigenvalues that the contour cannot
// enclose are split off (a corrected form of Remark 2.1). On their subspace the differential equation is solved exactly
// for s̃ by φ-functions.
class ContourStates {
 public:
  // `context` and `split` must outlive it. Computes e^{At} x0: by one matrix exponential per step length, or, if the
  // options ask for it, by the contour of Remark 2.3. If the spectrum does not allow that contour, a warning is added
  // and matrix exponentials are used.
  ContourStates(SolveContext& context, const Contour& contour, const SpectrumSplit& split);

  // x at all columns of NodeColumns, for `sources` given at the same columns. Parallel over times and contour nodes,
  // with the same bits for any number of threads. Incomplete if a stop was requested. Cost: O(J² P m).
  Matrix Solve(const Matrix& sources) const;

 private:
  void PrepareInitialResponse();
  void InitialResponseByExponentials();
  void InitialResponseByContour(const Contour& contour);
  void PrepareSeparatedPart();
  // weight (zI - T)⁻¹ ∫_0^t e^{z(t-τ)} s̃(τ) dτ at node `node_index` of the grid, in Schur coordinates.
  Eigen::VectorXcd Contribution(const std::vector<InterpolatedRun>& sources, Index node_index,
                                const ContourNode& node) const;
  void AddContourPart(const std::vector<InterpolatedRun>& sources, Matrix& x) const;
  void AddSeparatedPart(const std::vector<InterpolatedRun>& sources, Matrix& x) const;

  SolveContext& context_;
  NodeColumns columns_;
  std::vector<ContourNode> nodes_;
  Index num_nodes_;  // P
  const SpectrumSplit& split_;
  Matrix initial_;  // e^{At} x0
  // For each run, on the subspace split off: e^{hA} and the weights of 1, θ, θ², ... over a step.
  std::vector<std::vector<Matrix>> separated_steps_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_CONTOUR_STATES_H_
