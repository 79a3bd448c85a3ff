// SPDX-License-Identifier: Apache-2.0
// Makes a sparse matrix row by row.

#ifndef DLCS_CORE_LINALG_ROW_WRITER_H_
#define DLCS_CORE_LINALG_ROW_WRITER_H_

#include <Eigen/SparseCore>
#include <algorithm>
#include <utility>
#include <vector>

#include "core/types.h"

namespace dlcs {

using RowMajorMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// The entries of a row may come in any order, in different columns.
class RowWriter {
 public:
  RowWriter(Index rows, Index columns, Index most_entries) : matrix_(rows, columns) { matrix_.reserve(most_entries); }

  void Add(Index column, double value) { entries_.emplace_back(column, value); }
  void EndRow() {
    std::sort(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    matrix_.startVec(row_);
    for (const auto& [column, value] : entries_) matrix_.insertBack(row_, column) = value;
    entries_.clear();
    ++row_;
  }
  // After the last row.
  RowMajorMatrix Finish() {
    matrix_.finalize();
    return std::move(matrix_);
  }

 private:
  RowMajorMatrix matrix_;
  std::vector<std::pair<Index, double>> entries_;
  Index row_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_ROW_WRITER_H_
