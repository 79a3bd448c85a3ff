// SPDX-License-Identifier: Apache-2.0

#include "core/discretization/scheme.h"

#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/balance.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/panel_product.h"
#include "core/linalg/phi_functions.h"

namespace dlcs {

void Propagate(const Scheme& scheme, Segment& segment) {
  const Index operations = 2 * (scheme.f_after.size() + scheme.y_after.size()) + scheme.state.size();
  ForPanels(segment.steps, operations, [&](Index begin, Index count) {
    auto x = segment.x.middleCols(begin + 1, count);
    x.noalias() = scheme.f_before * segment.f.middleCols(begin, count);
    x.noalias() += scheme.f_after * segment.f.middleCols(begin + 1, count);
    x.noalias() += scheme.y_before * segment.y.middleCols(begin, count);
    x.noalias() += scheme.y_after * segment.y.middleCols(begin + 1, count);
    for (Index j = begin + 1; j <= begin + count; ++j) {
      segment.x.col(j).noalias() += scheme.state * segment.x.col(j - 1);
    }
  });
}

namespace {

// The weights of s_{j-1} and s_j after a step, and at its middle, for a source linear over the step; the two
// sets share one evaluation of the φ-functions.
struct ExponentialWeights {
  Matrix state, before, after;
  Matrix mid_state, mid_before, mid_after;
};

ExponentialWeights ComputeWeights(const Matrix& A, double step) {
  const auto [half, full] = ComputePhiFunctionsOfStep(step * A);
  ExponentialWeights weights;
  weights.state = full.phi0;
  weights.before = step * (full.phi1 - full.phi2);
  weights.after = step * full.phi2;
  // Over the first half the source runs from s_{j-1} to (s_{j-1} + s_j)/2.
  weights.mid_state = half.phi0;
  weights.mid_after = step / 4 * half.phi2;
  weights.mid_before = step / 2 * half.phi1 - weights.mid_after;
  return weights;
}

Scheme WithSources(const ExponentialWeights& weights, double step) {
  Scheme scheme;
  scheme.step = step;
  scheme.state = weights.state;
  scheme.f_before = weights.before;
  scheme.f_after = weights.after;
  scheme.mid_state = weights.mid_state;
  scheme.mid_f_before = weights.mid_before;
  scheme.mid_f_after = weights.mid_after;
  return scheme;
}

// matrix⁻¹ and matrix⁻¹ right; no product where `right` is empty.
struct Solved {
  Matrix inverse, product;
  bool is_regular = false;
};

// Units of the rows and columns must not count: ill-conditioned matrices are tried once more in balanced ones, with
// rows of size one, where zeros below blocks and small entries beside large ones are kept.
Solved SolveBalanced(const Matrix& matrix, const Matrix& right) {
  const BalancedMatrix balanced = Balance(matrix);
  const Index m = matrix.rows();
  Matrix rows = balanced.matrix;
  Vector scale(m);
  for (Index k = 0; k < m; ++k) {
    const double size = rows.row(k).cwiseAbs().maxCoeff();
    scale[k] = size > 0 && std::isfinite(size) ? std::ldexp(1.0, -std::ilogb(size)) : 1;
    rows.row(k) *= scale[k];
  }
  const PanelLu factor(rows);
  const Matrix inverse = factor.Solve(Matrix(scale.asDiagonal()));
  Solved solved;
  // [Skeel 1979]: what changes of one ulp of each entry do.
  const double condition = InfinityNorm(Product(inverse.cwiseAbs(), balanced.matrix.cwiseAbs()));
  solved.is_regular = condition < 1 / std::numeric_limits<double>::epsilon();
  solved.inverse = InGivenUnits(inverse, balanced);
  if (right.size() > 0) {
    solved.product = InGivenUnits(factor.Solve(scale.asDiagonal() * InUnitsOf(balanced, right)), balanced);
  }
  return solved;
}

Solved Solve(const Matrix& matrix, const Matrix& right) {
  // A plain solve then loses 7 of 53 bits, and less than half of that on average: with a factor of 4 here a step is as
  // exact up to two bits, or takes some more operations.
  constexpr double kWellConditioned = 128;
  const PanelLu factor(matrix);
  Solved solved;
  solved.inverse = factor.Solve(Matrix::Identity(matrix.rows(), matrix.cols()));
  solved.is_regular = InfinityNorm(matrix) * InfinityNorm(solved.inverse) < kWellConditioned;
  if (!solved.is_regular) return SolveBalanced(matrix, right);
  if (right.size() > 0) solved.product = factor.Solve(right);
  return solved;
}

}  // namespace

Scheme ExponentialPiecewiseLinear(const Problem& problem, double step) {
  const ExponentialWeights weights = ComputeWeights(problem.A, step);
  Scheme scheme = WithSources(weights, step);
  scheme.y_before = Product(weights.before, problem.B.Dense());
  scheme.y_after = Product(weights.after, problem.B.Dense());
  scheme.mid_y_before = Product(weights.mid_before, problem.B.Dense());
  scheme.mid_y_after = Product(weights.mid_after, problem.B.Dense());
  scheme.y_is_linear = true;
  scheme.order = 2;
  return scheme;
}

Scheme ExponentialPiecewiseConstant(const Problem& problem, double step) {
  const ExponentialWeights weights = ComputeWeights(problem.A, step);
  Scheme scheme = WithSources(weights, step);
  scheme.y_after = Product(weights.before + weights.after, problem.B.Dense());
  scheme.mid_y_after = Product(weights.mid_before + weights.mid_after, problem.B.Dense());
  return scheme;
}

Scheme ThetaScheme(const Problem& problem, double step, double theta) {
  const Matrix identity = Matrix::Identity(problem.num_states(), problem.num_states());
  const Matrix implicit = identity - step * (1 - theta) * problem.A.Dense();
  Solved solved = Solve(implicit, theta == 0 ? Matrix() : Matrix(identity + step * theta * problem.A.Dense()));
  Scheme scheme;
  scheme.step = step;
  scheme.state = theta == 0 ? solved.inverse : std::move(solved.product);
  scheme.f_after = step * solved.inverse;
  scheme.y_after = Product(scheme.f_after, problem.B.Dense());
  scheme.x_is_linear = true;
  if (!solved.is_regular) scheme.state.setConstant(std::numeric_limits<double>::quiet_NaN());
  return scheme;
}

Scheme AveragedScheme(const Problem& problem, double step) {
  Scheme scheme = ThetaScheme(problem, step, 0.5);
  scheme.f_after /= 2;
  scheme.f_before = scheme.f_after;
  scheme.y_after /= 2;
  scheme.y_before = scheme.y_after;
  scheme.y_is_linear = true;
  scheme.order = 2;
  return scheme;
}

}  // namespace dlcs
