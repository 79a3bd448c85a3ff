// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/structural_zeros.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/linalg/strong_components.h"

namespace dlcs {
namespace {

constexpr Index kNone = -1;

// The row that is matched with each column, by augmenting paths; empty if there is no matching of all.
class RowMatching {
 public:
  explicit RowMatching(const Eigen::Ref<const Matrix>& matrix)
      : matrix_(matrix), row_of_(static_cast<std::size_t>(matrix.cols()), kNone) {}

  std::vector<Index> Find() {
    for (Index row = 0; row < matrix_.rows(); ++row) {
      seen_.assign(row_of_.size(), false);
      if (!Augment(row)) return {};
    }
    return row_of_;
  }

 private:
  struct Visit {
    Index row;
    Index column;  // the next one to look at
  };

  // A path from `row` over matched rows to a column that is free; without recursion.
  bool Augment(Index first) {
    std::vector<Visit> path = {{first, 0}};
    for (Index column = 0; column < matrix_.cols(); ++column) {
      if (matrix_(first, column) == 0 || row_of_[At(column)] != kNone) continue;
      row_of_[At(column)] = first;
      return true;
    }
    while (!path.empty()) {
      Visit& visit = path.back();
      while (visit.column < matrix_.cols() && (matrix_(visit.row, visit.column) == 0 || seen_[At(visit.column)])) {
        ++visit.column;
      }
      if (visit.column == matrix_.cols()) {
        path.pop_back();
        if (!path.empty()) ++path.back().column;
        continue;
      }
      seen_[At(visit.column)] = true;
      const Index taken_by = row_of_[At(visit.column)];
      if (taken_by != kNone) {
        path.push_back({taken_by, 0});
        continue;
      }
      for (const Visit& step : path) row_of_[At(step.column)] = step.row;
      return true;
    }
    return false;
  }

  static std::size_t At(Index index) { return static_cast<std::size_t>(index); }

  const Eigen::Ref<const Matrix>& matrix_;
  std::vector<Index> row_of_;
  std::vector<bool> seen_;
};

}  // namespace

void ClearStructuralZeros(const Eigen::Ref<const Matrix>& matrix, Matrix& inverse) {
  if (matrix.rows() < 2 || (matrix.array() != 0).all()) return;
  const std::vector<Index> row_of = RowMatching(matrix).Find();
  if (row_of.empty()) return;
  const Matrix by_unknown = matrix(row_of, Eigen::all);
  const std::vector<std::vector<Index>> blocks = StronglyConnected(by_unknown);
  if (blocks.size() < 2) return;
  // reaches[b][c]: the unknowns of block b depend on those of block c, which is a later one.
  std::vector<std::size_t> block_of(row_of.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (const Index k : blocks[b]) block_of[static_cast<std::size_t>(k)] = b;
  }
  std::vector<std::vector<bool>> reaches(blocks.size(), std::vector<bool>(blocks.size(), false));
  for (std::size_t b = blocks.size(); b-- > 0;) {
    reaches[b][b] = true;
    for (const Index k : blocks[b]) {
      for (Index j = 0; j < by_unknown.cols(); ++j) {
        const std::size_t c = block_of[static_cast<std::size_t>(j)];
        if (by_unknown(k, j) == 0 || reaches[b][c]) continue;
        for (std::size_t d = c; d < blocks.size(); ++d) reaches[b][d] = reaches[b][d] || reaches[c][d];
      }
    }
  }
  for (Index k = 0; k < inverse.rows(); ++k) {
    const std::vector<bool>& depends = reaches[block_of[static_cast<std::size_t>(k)]];
    for (Index j = 0; j < inverse.rows(); ++j) {
      if (!depends[block_of[static_cast<std::size_t>(j)]]) inverse(k, row_of[static_cast<std::size_t>(j)]) = 0;
    }
  }
}

}  // namespace dlcs
