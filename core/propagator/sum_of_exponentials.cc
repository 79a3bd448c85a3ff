// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/sum_of_exponentials.h"

#include <cmath>
#include <vector>

#include "core/linalg/decompositions.h"

namespace dlcs {
namespace {

SumOfExponentials WithoutZeros(const SumOfExponentials& sum) {
  std::vector<Index> kept;
  for (Index k = 0; k < sum.weights.size(); ++k) {
    if (sum.weights[k] != 0) kept.push_back(k);
  }
  return {.rates = sum.rates(kept), .weights = sum.weights(kept)};
}

struct PivotedFactor {
  Matrix L;
  std::vector<Index> pivots;  // rows `pivots` of L are lower triangular
};

// L with L Lᵀ = P, P_ik = b_i b_k / (d_i + d_k), up to a rest whose diagonal is at most `negligible` of that of P.
// Schur complements of a Cauchy matrix are Cauchy matrices with u_i = b_i Π_p (d_i - d_p)/(d_i + d_p) in place of b, p
// the pivots so far: nothing is subtracted, and the smallest columns are as accurate as the first.
// Source: [Demmel 1999] J. Demmel. Accurate singular value decompositions of structured matrices. SIAM J. Matrix Anal.
// Appl. 21.
PivotedFactor FactorGramian(const Vector& d, const Vector& b, double negligible) {
  constexpr Index kMaxColumns = 200;
  const Index size = d.size();
  PivotedFactor factor{Matrix(size, std::min(size, kMaxColumns)), {}};
  Vector u = b;
  double largest = 0;
  Index rank = 0;
  for (; rank < factor.L.cols(); ++rank) {
    Index pivot;
    const double rest = u.cwiseAbs2().cwiseQuotient(2 * d).maxCoeff(&pivot);
    largest = std::max(largest, rest);
    if (rest <= negligible * largest) break;
    const double at = d[pivot];
    factor.L.col(rank) = std::sqrt(2 * at) * u.array() / (d.array() + at);
    u.array() *= (d.array() - at) / (d.array() + at);
    factor.pivots.push_back(pivot);
  }
  factor.L.conservativeResize(Eigen::NoChange, rank);
  return factor;
}

}  // namespace

SumOfExponentials Compress(const SumOfExponentials& given, double tolerance) {
  const SumOfExponentials sum = WithoutZeros(given);
  if (sum.weights.size() < 2 || sum.rates.maxCoeff() >= 0 || sum.weights.minCoeff() * sum.weights.maxCoeff() < 0) {
    return sum;
  }
  const double sign = sum.weights[0] > 0 ? 1 : -1;
  const Vector d = -sum.rates;
  const Vector b = (sign * sum.weights).cwiseSqrt();
  const Matrix L = FactorGramian(d, b, 1e-20).L;
  const Eigen::SelfAdjointEigenSolver<Matrix> gramian(L.transpose() * L);
  const Vector singular = gramian.eigenvalues().reverse().cwiseMax(0);
  const double gain = b.cwiseAbs2().cwiseQuotient(d).sum();  // |H(0)|, the largest

  Index terms = singular.size();
  double error = 0;
  while (terms > 1 && 2 * (error + singular[terms - 1]) <= tolerance * gain) error += singular[--terms];
  if (terms >= sum.weights.size()) return sum;

  const Matrix span = L * gramian.eigenvectors().rowwise().reverse().leftCols(terms);
  const Matrix V = Eigen::HouseholderQR<Matrix>(span).householderQ() * Matrix::Identity(d.size(), terms);
  const Eigen::SelfAdjointEigenSolver<Matrix> reduced(-(V.transpose() * d.asDiagonal() * V));
  return {.rates = reduced.eigenvalues(),
          .weights = sign * (reduced.eigenvectors().transpose() * (V.transpose() * b)).cwiseAbs2(),
          .error = 2 * error / gain};
}

ExponentialBasis ChooseBasis(const Vector& rates) {
  const Index size = rates.size();
  ExponentialBasis basis;
  if (rates.maxCoeff() < 0) {
    // In units of its own norm each function counts alike.
    const Vector d = -rates;
    const PivotedFactor factor = FactorGramian(d, (2 * d).cwiseSqrt(), 1e-27);
    const auto triangle = factor.L(factor.pivots, Eigen::all).template triangularView<Eigen::Lower>();
    basis.kept = factor.pivots;
    basis.weights = triangle.solve<Eigen::OnTheRight>(factor.L);
    for (Index k = 0; k < basis.weights.cols(); ++k) {
      basis.weights.col(k) *= std::sqrt(d[factor.pivots[static_cast<std::size_t>(k)]]);
    }
    basis.weights.array().colwise() /= d.array().sqrt();
    return basis;
  }
  for (Index k = 0; k < size; ++k) basis.kept.push_back(k);
  basis.weights = Matrix::Identity(size, size);
  return basis;
}

}  // namespace dlcs
