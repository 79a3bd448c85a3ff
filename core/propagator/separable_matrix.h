// SPDX-License-Identifier: Apache-2.0
// What leads from constraints to the points of a wall, or back.

#ifndef DLCS_CORE_PROPAGATOR_SEPARABLE_MATRIX_H_
#define DLCS_CORE_PROPAGATOR_SEPARABLE_MATRIX_H_

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// A sparse matrix, quick where it is diagonal: with one constraint at each point of a wall, in their order.
class SeparableMatrix {
 public:
  SeparableMatrix() = default;
  explicit SeparableMatrix(SparseMatrix matrix);

  const SparseMatrix& sparse() const { return matrix_; }
  bool is_diagonal() const { return diagonal_.size() > 0; }

  // product = matrix · values; in place (both the same) where it is diagonal.
  void Multiply(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> product) const;
  // sum += matrix · values
  void AddProduct(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> sum) const;

 private:
  SparseMatrix matrix_;
  Vector diagonal_;  // empty where there are other entries
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_SEPARABLE_MATRIX_H_
