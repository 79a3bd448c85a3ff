// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/m_matrix.h"

#include <algorithm>
#include <numeric>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/simd/elimination_loops.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

Bandwidth BandwidthOf(const Matrix& M) {
  Bandwidth band;
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      if (M(i, j) == 0) continue;
      band.below = std::max(band.below, i - j);
      band.above = std::max(band.above, j - i);
    }
  }
  return band;
}

MMatrixFactor::MMatrixFactor(const Matrix& M) : band_(BandwidthOf(M)), lu_(M.rows(), M.rows()) {}

MMatrixFactor::MMatrixFactor(const MMatrixFactor& other)
    : band_(other.band_), lu_(other.lu_.rows(), other.lu_.cols()) {}

Index MMatrixFactor::Factor(const Matrix& M, std::span<const Index> indices) {
  constexpr Index kPanel = 12;  // by trial: 8 to 16 are within 5 % for n = 64 to 255
  const Index size = static_cast<Index>(indices.size());
  const bool increasing = std::is_sorted(indices.begin(), indices.end());
  factors_band_ = increasing ? band_ : Bandwidth{size, size};
  const auto [below, above] = factors_band_;
  for (Index j = 0; j < size; ++j) {
    const Index last = std::min(size - 1, j + below);
    for (Index i = std::max<Index>(0, j - above); i <= last; ++i) lu_(i, j) = M(indices[i], indices[j]);
  }
  // Bands are eliminated column by column; for full matrices the columns behind a panel take its products together.
  const Index panel = std::min(below, above) >= size - 1 ? kPanel : size;
  for (Index begin = 0; begin < size; begin += panel) {
    LookForStop();
    const Index end = std::min(size, begin + panel);
    for (Index p = begin; p < end; ++p) {
      const double diagonal = M(indices[p], indices[p]);
      const double pivot = lu_(p, p);
      if (!(pivot > kClearPivot * diagonal) && !IsPositiveBeyondRounding(M, indices, p)) return p;
      const Index rows = std::min(size - 1, p + below) - p;
      const Index last_column = std::min(end - 1, p + above);
      double* const multipliers = &lu_(p, p) + 1;
      const double inverse = 1 / pivot;
      for (Index i = 0; i < rows; ++i) multipliers[i] *= inverse;
      for (Index j = p + 1; j <= last_column; ++j) SubtractMultiple(rows, lu_(p, j), multipliers, &lu_(p, j) + 1);
    }
    if (end < size) UpdateBehind(begin, end, size);
  }
  return size;
}

void MMatrixFactor::UpdateBehind(Index begin, Index end, Index size) {
  const Index stride = lu_.rows();
  for (Index j = end; j < size; ++j) SubstituteForward(end - begin, &lu_(begin, begin), stride, &lu_(begin, j));
  SubtractProduct(size - end, size - end, end - begin, &lu_(end, begin), stride, &lu_(begin, end), stride,
                  &lu_(end, end), stride);
}

// The pivot is the Schur complement d = M_rr - M_rS M_SS⁻¹ M_Sr. The factors are exact for a matrix that
// differs from M by a few units of rounding per entry, E, which moves d by xᵀ E z to first order, with
// x = (-M_SS⁻ᵀ M_rSᵀ, 1) and z = (-M_SS⁻¹ M_Sr, 1), both nonnegative.
bool MMatrixFactor::IsPositiveBeyondRounding(const Matrix& M, std::span<const Index> indices, Index p) const {
  constexpr Index kOperations = 16;  // a few units of rounding, and as much for second order
  if (!(lu_(p, p) > 0)) return false;
  Vector x(p), z(p);
  for (Index i = 0; i < p; ++i) {
    x[i] = M(indices[p], indices[i]);
    z[i] = M(indices[i], indices[p]);
  }
  SolveTransposed(x);
  Solve(z);
  double bound = M(indices[p], indices[p]);
  for (Index j = 0; j < p; ++j) {
    for (Index i = 0; i < p; ++i) bound += std::abs(x[i] * M(indices[i], indices[j]) * z[j]);
    bound += std::abs(M(indices[p], indices[j]) * z[j]) + std::abs(x[j] * M(indices[j], indices[p]));
  }
  return lu_(p, p) > RoundingOf(kOperations) * bound;
}

void MMatrixFactor::Solve(Eigen::Ref<Vector> x) const {
  const Index size = x.size();
  for (Index p = 0; p < size; ++p) {
    const Index last = std::min(size - 1, p + factors_band_.below);
    SubtractMultiple(last - p, x[p], &lu_(p, p) + 1, &x[p] + 1);
  }
  for (Index p = size - 1; p >= 0; --p) {
    x[p] /= lu_(p, p);
    const Index first = std::max<Index>(0, p - factors_band_.above);
    SubtractMultiple(p - first, x[p], &lu_(first, p), &x[first]);
  }
}

void MMatrixFactor::SolveTransposed(Eigen::Ref<Vector> x) const {
  const Index size = x.size();
  for (Index p = 0; p < size; ++p) {
    for (Index i = std::max<Index>(0, p - factors_band_.above); i < p; ++i) x[p] -= lu_(i, p) * x[i];
    x[p] /= lu_(p, p);
  }
  for (Index p = size - 1; p >= 0; --p) {
    const Index last = std::min(size - 1, p + factors_band_.below);
    for (Index i = p + 1; i <= last; ++i) x[p] -= lu_(i, p) * x[i];
  }
}

bool IsZMatrix(const Matrix& M) {
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      if (i != j && M(i, j) > 0) return false;
    }
  }
  return true;
}

bool IsNonsingularMMatrix(const Matrix& M) {
  std::vector<Index> all(M.rows());
  std::iota(all.begin(), all.end(), Index{0});
  return MMatrixFactor(M).Factor(M, all) == M.rows();
}

Matrix ComparisonMatrix(const Matrix& M) {
  Matrix comparison = -M.cwiseAbs();
  comparison.diagonal() = M.diagonal().cwiseAbs();
  return comparison;
}

}  // namespace dlcs
