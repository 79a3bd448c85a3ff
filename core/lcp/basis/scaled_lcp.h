// SPDX-License-Identifier: Apache-2.0
// One LCP in the units in which the solvers of this folder work.

#ifndef DLCS_CORE_LCP_BASIS_SCALED_LCP_H_
#define DLCS_CORE_LCP_BASIS_SCALED_LCP_H_

#include <memory>

#include "core/linalg/equilibration.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/types.h"

namespace dlcs {

// The matrix of LCP(R q, R M C) for LCP(q, M), with R and C the powers of two of EquilibrateRowsAndColumns(): what is
// found does not depend on the units of y and w.
struct ScaledMatrix {
  explicit ScaledMatrix(const Matrix& original);

  // C M C, which is congruent to M: positive semidefinite where M is.
  Matrix Congruent() const { return scale.column.cwiseQuotient(scale.row).asDiagonal() * M; }

  Equilibration scale;  // R, C
  Matrix M;             // R M C
  Bandwidth band;       // of M
};

// One such LCP, the input of all solvers of this folder, which return y = C y'. Copies share the matrix.
struct ScaledLcp {
  // q = 0 and no tolerance until Load().
  explicit ScaledLcp(const Matrix& M);

  // Takes the right-hand side and the absolute tolerances of w, both in the caller's units. False when an
  // entry of `q` is not finite. Does not allocate.
  bool Load(const Eigen::Ref<const Vector>& original_q, const Eigen::Ref<const Vector>& original_tolerance);

  Index size() const { return q.size(); }
  const Matrix& M() const { return matrix->M; }
  // y_i in the caller's units.
  double Original(Index i, double y) const { return matrix->scale.column[i] * y; }

  std::shared_ptr<const ScaledMatrix> matrix;
  Vector q;          // R q
  Vector tolerance;  // R · tolerance
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_SCALED_LCP_H_
