// SPDX-License-Identifier: Apache-2.0
// Recognizes matrices that act along one axis of a grid through a single vector.

#ifndef DLCS_CORE_PROPAGATOR_OUTER_PRODUCT_H_
#define DLCS_CORE_PROPAGATOR_OUTER_PRODUCT_H_

#include <optional>

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// A sparse matrix with a fast path for diagonal ones, as with one constraint at each point of a side of the grid, in
// order.
class SeparableMatrix {
 public:
  SeparableMatrix() = default;
  explicit SeparableMatrix(SparseMatrix matrix);

  const SparseMatrix& sparse() const { return matrix_; }
  bool is_diagonal() const { return diagonal_.size() > 0; }

  // product = matrix · values; in place (both the same) where it is diagonal.
  void Multiply(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> product) const;
  // sum = base + matrix · values; in place where `base` is `sum`.
  void AddProduct(const Eigen::Ref<const Matrix>& base, const Eigen::Ref<const Matrix>& values,
                  Eigen::Ref<Matrix> sum) const;

 private:
  SparseMatrix matrix_;
  Vector diagonal_;  // empty where there are other entries
};

// The rows of a matrix as points of a grid: row (s · length + a) · faster + f.
struct Axis {
  Index length = 1;  // of the axis, a
  Index faster = 1;  // points that run faster, f
};

// The matrix whose entry in row (s, a, f) and column c is along_a · across_{(s, f), c}, (s, f) = s · faster + f.
struct OuterProduct {
  Vector along;
  SparseMatrix across;
};

// `matrix` in that form, to rounding; absent where it has none. A zero matrix has it.
std::optional<OuterProduct> AsOuterProduct(const SparseMatrix& matrix, const Axis& axis);

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_OUTER_PRODUCT_H_
