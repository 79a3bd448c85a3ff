// SPDX-License-Identifier: Apache-2.0
// A sparse matrix row by row, for products and sweeps over its rows.

#ifndef DLCS_CORE_LINALG_SPARSE_COMPRESSED_ROWS_H_
#define DLCS_CORE_LINALG_SPARSE_COMPRESSED_ROWS_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// Row i has the entries start[i] <= k < start[i + 1], by increasing column.
template <typename Scalar>
struct CompressedRows {
  Index cols = 0;
  std::vector<int> start = {0};
  std::vector<int> column = {};
  std::vector<Scalar> value = {};

  Index rows() const { return static_cast<Index>(start.size()) - 1; }
  Index nonzeros() const { return static_cast<Index>(column.size()); }
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_COMPRESSED_ROWS_H_
