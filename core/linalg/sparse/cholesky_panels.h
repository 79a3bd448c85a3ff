// SPDX-License-Identifier: Apache-2.0
// A sparse Cholesky factor as dense panels, for quick solves.

#ifndef DLCS_CORE_LINALG_SPARSE_CHOLESKY_PANELS_H_
#define DLCS_CORE_LINALG_SPARSE_CHOLESKY_PANELS_H_

#include <cstddef>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// The factor L of L Lᵀ. Neighboring columns with the same rows, or nearly so, are one panel: it needs its row numbers
// only once, and its loops run over numbers that lie side by side. So a solve takes a third of the time that it takes
// column by column. Source: [Ng, Peyton 1993] Block sparse Cholesky algorithms on advanced uniprocessor computers. SIAM
// J. Sci. Comput. 14, 1034-1056.
class CholeskyPanels {
 public:
  CholeskyPanels() = default;
  // `L` is lower triangular with a positive diagonal.
  explicit CholeskyPanels(const SparseMatrix& L);

  // x := L⁻¹ x and x := L⁻ᵀ x. Safe to call from several threads. Panels that zeros of x reach only are passed over.
  void SolveForward(Vector& x) const;
  void SolveBackward(Vector& x) const;

  // The stored numbers, a few of them zeros.
  Index numbers() const { return static_cast<Index>(values_.size()); }
  double bytes() const;

 private:
  // The columns [first, first + width): `width` rows of a triangle, whose diagonal is inverted, and below them those of
  // rows_. Columns lie one after the other.
  struct Panel {
    Index first, width;
    Index begin_of_rows, rows;
    std::size_t begin_of_values;

    Index stride() const { return width + rows; }
  };

  void AddPanel(const SparseMatrix& L, Index first, Index end);

  std::vector<Panel> panels_;
  std::vector<int> rows_;
  std::vector<double> values_;
  Index most_rows_ = 0;  // of a panel
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_CHOLESKY_PANELS_H_
