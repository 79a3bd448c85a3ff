// SPDX-License-Identifier: Apache-2.0
// Products of symmetric sparse matrices whose entries fill a few diagonals.

#ifndef DLCS_CORE_LINALG_SPARSE_SYMMETRIC_DIAGONALS_H_
#define DLCS_CORE_LINALG_SPARSE_SYMMETRIC_DIAGONALS_H_

#include <optional>
#include <vector>

#include "core/linalg/sparse/compressed_rows.h"
#include "core/types.h"

namespace dlcs {

// The main diagonal and those above it that have few gaps, which stand for those below as well, and the other entries
// by rows. A product reads some 40 % of what it reads of a matrix by rows, and passes over memory are what it costs.
class SymmetricDiagonals {
 public:
  // Absent where K is not symmetric to the last bit, or too many of its entries are others. Cost: O(nonzeros).
  static std::optional<SymmetricDiagonals> Of(const CompressedRows<double>& K);

  // product[i - begin] = (K x)_i for these rows, whose bits do not depend on which rows are multiplied together.
  void MultiplyRows(const double* x, Index begin, Index end, double* product) const;

 private:
  Index size_ = 0;
  std::vector<Index> shifts_;          // increasing
  std::vector<Vector> diagonals_;      // K(i, i + shift)
  std::vector<Index> rows_of_others_;  // increasing; others_ has these rows only
  CompressedRows<double> others_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_SYMMETRIC_DIAGONALS_H_
