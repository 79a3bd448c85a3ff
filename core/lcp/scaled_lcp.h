// SPDX-License-Identifier: Apache-2.0
// One LCP in the units in which the solvers of this folder work.

#ifndef DLCS_CORE_LCP_SCALED_LCP_H_
#define DLCS_CORE_LCP_SCALED_LCP_H_

#include <memory>

#include "core/analysis/m_matrix.h"
#include "core/types.h"

namespace dlcs {

// The matrix of LCP(D q, D M D) for LCP(q, M), with D the powers of two of SymmetricEquilibration().
struct ScaledMatrix {
  explicit ScaledMatrix(const Matrix& original);

  Vector scale;          // D
  Matrix M;              // D M D
  Vector row_sum;        // Σ_j |(D M D)_ij|
  Bandwidth band;        // of M
  double original_norm;  // ‖M‖_∞ in the caller's units
};

// One such LCP. All solvers of this folder read this struct; only its y = D y' leaves it. Copies share the
// matrix.
struct ScaledLcp {
  // q = 0 and no tolerance until Load().
  explicit ScaledLcp(const Matrix& M);

  // Takes the right-hand side and the absolute tolerances of w, both in the caller's units. False when an
  // entry of `q` is not finite. Does not allocate.
  bool Load(const Eigen::Ref<const Vector>& original_q, const Eigen::Ref<const Vector>& original_tolerance);

  Index size() const { return q.size(); }
  const Matrix& M() const { return matrix->M; }

  std::shared_ptr<const ScaledMatrix> matrix;
  Vector q;          // D q
  Vector tolerance;  // D · tolerance
  double original_q_norm = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_SCALED_LCP_H_
