// SPDX-License-Identifier: Apache-2.0
// Sparse factors L U with pivots on the diagonal as dense panels, for quick solves.

#ifndef DLCS_CORE_LINALG_SPARSE_FACTOR_PANELS_H_
#define DLCS_CORE_LINALG_SPARSE_FACTOR_PANELS_H_

#include <cstddef>
#include <optional>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// The columns of the factor L of a matrix with the pattern of `matrix` and its transpose, in its own order: their
// parents in the elimination tree, or -1, and how many entries each has, with that on the diagonal.
struct FactorColumns {
  std::vector<int> parents;
  std::vector<Index> entries;
};

// Cost: two operations for each entry of L, which is not made. Source: [Liu 1990] The role of elimination trees in
// sparse factorization. SIAM J. Matrix Anal. Appl. 11, 134-172.
FactorColumns PredictColumns(const SparseMatrix& matrix, const SparseMatrix& transpose);

// The factors of L U, where Uᵀ has the pattern of L and the diagonals of both have the same size; of L Lᵀ, where one
// serves both. Neighboring columns with the same rows, or nearly so, are one panel: it needs its row numbers only once,
// and its loops run over numbers that lie side by side. So factors and solves take half the time that they take column
// by column, or less. Source: [Ng, Peyton 1993] Block sparse Cholesky algorithms on advanced uniprocessor computers.
// SIAM J. Sci. Comput. 14, 1034-1056, whose left-looking form this is.
class FactorPanels {
 public:
  // The factors of a symmetric matrix, of which the lower triangle is read; none where it is not positive definite.
  static std::optional<FactorPanels> Cholesky(const SparseMatrix& matrix);
  // Those of any square matrix with its pivots on the diagonal; none where one of them is zero, not finite, or smaller
  // than `threshold` times the largest entry that is left in its column.
  static std::optional<FactorPanels> Lu(const SparseMatrix& matrix, double threshold);

  // x := L⁻¹ x, x := U⁻ᵀ x and x := U⁻¹ x. Safe to call from several threads. The first two pass over panels that only
  // zeros of x reach.
  void SolveForward(Vector& x) const { SolveForward(lower_, x); }
  void SolveTransposedForward(Vector& x) const { SolveForward(upper(), x); }
  void SolveBackward(Vector& x) const;

  // The stored numbers of L, a few of them zeros.
  Index numbers() const { return static_cast<Index>(lower_.size()); }
  double bytes() const;
  // What a solve reads.
  double bytes_of_a_solve() const;

 private:
  // The columns [first, first + width): `width` rows of a triangle, whose diagonal is inverted, and below them those of
  // rows_. Columns lie one after the other.
  struct Panel {
    Index first, width;
    Index begin_of_rows, rows;
    std::size_t begin_of_values;

    Index end() const { return first + width; }
    Index stride() const { return width + rows; }
  };
  struct Factorization;

  FactorPanels(const SparseMatrix& matrix, const SparseMatrix& transpose, bool is_symmetric);

  const std::vector<double>& upper() const { return is_symmetric_ ? lower_ : upper_; }
  const int* RowsOf(const Panel& panel) const { return rows_.data() + panel.begin_of_rows; }
  double bytes_of_rows() const;

  void AddPanel(Index first, Index end);
  std::vector<std::size_t> PanelOfColumns() const;
  void FindRows(const SparseMatrix& matrix, const SparseMatrix& transpose);
  void SolveForward(const std::vector<double>& values, Vector& x) const;

  bool is_symmetric_;
  std::vector<Panel> panels_;
  std::vector<int> rows_;
  std::vector<double> lower_, upper_;  // L, and Uᵀ unless it is L
  Index most_rows_ = 0;                // of a panel
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_FACTOR_PANELS_H_
