// SPDX-License-Identifier: Apache-2.0
// LU factors of large dense matrices, by a computation that can be stopped.

#ifndef DLCS_CORE_LINALG_PANEL_LU_H_
#define DLCS_CORE_LINALG_PANEL_LU_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// Overwrites the square `matrix` with L (below the diagonal; ones on it) and U, rows exchanged for the largest pivot:
// row p of L U is row source[p] of the original matrix. A column without a pivot leaves zeros or NaN on the diagonal of
// U. Checks for a stop about every ten milliseconds (core/parallel/stop_scope.h). Cost: 2/3 n³ operations.
void FactorInPanels(Eigen::Ref<Matrix> matrix, std::vector<Index>& source);

// The factors of a matrix, computed by FactorInPanels().
class PanelLu {
 public:
  explicit PanelLu(Matrix matrix);

  // matrix⁻¹ columns; not finite where the matrix is singular.
  Matrix Solve(const Eigen::Ref<const Matrix>& columns) const;

  // An estimate of 1/(‖matrix‖₁ ‖matrix⁻¹‖₁), hardly ever more than three times too large; 0 where the matrix is
  // singular or not finite. Cost: some 10 n². Source: [Higham 2002] N. J. Higham. Accuracy and Stability of Numerical
  // Algorithms. SIAM. Algorithm 15.1.
  double ReciprocalCondition() const;

 private:
  Vector SolveTransposed(Vector x) const;

  double norm_;  // ‖matrix‖₁
  Matrix lu_;
  std::vector<Index> source_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PANEL_LU_H_
