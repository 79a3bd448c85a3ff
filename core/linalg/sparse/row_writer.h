// SPDX-License-Identifier: Apache-2.0
// Makes a sparse matrix row by row.

#ifndef DLCS_CORE_LINALG_SPARSE_ROW_WRITER_H_
#define DLCS_CORE_LINALG_SPARSE_ROW_WRITER_H_

#include <Eigen/SparseCore>
#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/types.h"

namespace dlcs {

using RowMajorMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// The most entries of a matrix, which counts them in 32 bits.
inline constexpr Index kMostEntries = std::numeric_limits<int>::max();
// Throws std::length_error if there would be more.
inline void CheckEntries(Index entries) {
  if (entries > kMostEntries) {
    throw std::length_error("a process would have more than " + std::to_string(kMostEntries) +
                            " entries of a matrix: start more ranks");
  }
}

// The entries of a row may come in any order, in different columns. Throws std::length_error for too many entries.
class RowWriter {
 public:
  RowWriter(Index rows, Index columns, Index most_entries) : matrix_(rows, columns) {
    CheckEntries(most_entries);
    matrix_.reserve(most_entries);
  }

  void Add(Index column, double value) { entries_.emplace_back(column, value); }
  void EndRow() {
    std::sort(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    matrix_.startVec(row_);
    for (const auto& [column, value] : entries_) matrix_.insertBack(row_, column) = value;
    entries_.clear();
    ++row_;
  }
  // After the last row. Swapped, as elsewhere, since Eigen 3.4 copies sparse matrices that are moved.
  RowMajorMatrix Finish() {
    matrix_.finalize();
    RowMajorMatrix finished;
    finished.swap(matrix_);
    return finished;
  }

 private:
  RowMajorMatrix matrix_;
  std::vector<std::pair<Index, double>> entries_;
  Index row_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_ROW_WRITER_H_
