// SPDX-License-Identifier: Apache-2.0
// Elimination without pivoting in principal submatrices of a Z-matrix.

#ifndef DLCS_CORE_MATRIX_CLASSES_M_MATRIX_H_
#define DLCS_CORE_MATRIX_CLASSES_M_MATRIX_H_

#include <span>
#include <vector>

#include "core/types.h"

namespace dlcs {

// M(i, j) = 0 for i - j > below and for j - i > above.
struct Bandwidth {
  Index below = 0;
  Index above = 0;
};
Bandwidth BandwidthOf(const Matrix& M);

// A pivot of a Z-matrix above this fraction of its diagonal entry has lost few digits, and is positive beyond doubt.
inline constexpr double kClearPivot = 1e-7;

// LU factors of M_SS for a Z-matrix M, and with them the answer to whether M_SS is a nonsingular M-matrix: a
// Z-matrix is one exactly when all pivots of an elimination without row exchanges are positive, in any one
// order [Berman & Plemmons 1994, Theorem 6.2.3]. Row exchanges would not help either: off-diagonal entries
// only add numbers of one sign, so nothing cancels but in the pivots themselves.
//
// Indices given in increasing order keep the band of M, and the work is then O(|S| b²) for bandwidth b,
// otherwise |S|³/3. Work space for n indices is allocated once. Not safe to share between threads.
class MMatrixFactor {
 public:
  // Reads size and bandwidth of `M`; the matrix itself is passed to Factor() again.
  explicit MMatrixFactor(const Matrix& M);
  MMatrixFactor(const MMatrixFactor& other);  // for the same matrix; the factors are not copied

  // Eliminates rows and columns `indices` of `M` (the matrix of the constructor) in that order, up to the
  // first pivot that is not positive beyond rounding. Returns the number of indices eliminated: M_SS is a
  // nonsingular M-matrix exactly when that is all of them.
  Index Factor(const Matrix& M, std::span<const Index> indices);

  // x := M_SS⁻¹ x and x := M_SS⁻ᵀ x for the first x.size() indices of the last Factor(), which must have
  // been eliminated.
  void Solve(Eigen::Ref<Vector> x) const;
  void SolveTransposed(Eigen::Ref<Vector> x) const;

  // The value of the pivot at position `p` of the last Factor(), also of the one that was refused.
  double pivot(Index p) const { return lu_(p, p); }

 private:
  // The rows and columns from `end` on, once the columns from `begin` to `end` are eliminated in a full matrix.
  void UpdateBehind(Index begin, Index end, Index size);
  bool IsPositiveBeyondRounding(const Matrix& M, std::span<const Index> indices, Index p) const;

  Bandwidth band_;          // of M
  Bandwidth factors_band_;  // of the last factors
  Matrix lu_;
};

// Whether no off-diagonal entry of `M` is positive.
bool IsZMatrix(const Matrix& M);

// Whether the Z-matrix `M` is a nonsingular M-matrix (equivalently, a P-matrix). O(n³).
bool IsNonsingularMMatrix(const Matrix& M);

// The comparison matrix ⟨M⟩: |M_ii| on the diagonal, -|M_ij| off it. `M` is an H-matrix when it is an
// M-matrix.
Matrix ComparisonMatrix(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_M_MATRIX_H_
