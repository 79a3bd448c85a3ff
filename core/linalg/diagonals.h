// SPDX-License-Identifier: Apache-2.0
// Products of sparse matrices whose entries fill a few diagonals.

#ifndef DLCS_CORE_LINALG_DIAGONALS_H_
#define DLCS_CORE_LINALG_DIAGONALS_H_

#include <Eigen/SparseCore>
#include <optional>
#include <vector>

#include "core/types.h"

namespace dlcs {

// A matrix stored by its diagonals, for products with many columns: loops along a diagonal are vectorized, unlike loops
// over the entries of a sparse matrix.
class Diagonals {
 public:
  // Absent if there are more than eight diagonals, or one has a gap. Cost: O(nonzeros).
  static std::optional<Diagonals> Of(const Eigen::SparseMatrix<double>& matrix);

  // product = matrix · values, with the bits of Eigen's sparse product: each row is summed from the left.
  void Multiply(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> product) const;
  // sum += matrix · values
  void AddProduct(const Eigen::Ref<const Matrix>& values, Eigen::Ref<Matrix> sum) const;

 private:
  // Entries (first + i, first + i + shift) for i < entries.size().
  struct Diagonal {
    Index first, shift;
    Vector entries;
  };
  std::vector<Diagonal> diagonals_;  // by increasing shift
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_DIAGONALS_H_
