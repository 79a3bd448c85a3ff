// SPDX-License-Identifier: Apache-2.0
// The tableau of complementary pivoting.

#ifndef DLCS_CORE_LCP_DENSE_PIVOT_TABLEAU_H_
#define DLCS_CORE_LCP_DENSE_PIVOT_TABLEAU_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// Which of several variables that fall to zero together leaves the basis.
enum class LemkeTies { kLexicographic, kFirst, kLast };

// The equations  basic + Σ column · nonbasic = right-hand side  of a dense tableau that holds the columns of the
// nonbasic variables only. Variables are those that are basic at first, one for each row (0 to rows - 1), and those
// that are not, one for each column (from rows on).
//
// Work space is allocated once, rows · columns numbers; a pivot costs twice as many operations. Not safe to share
// between threads.
class PivotTableau {
 public:
  static constexpr Index kNone = -1;
  using Values = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  PivotTableau(Index rows, Index columns);

  Index rows() const { return values_.rows(); }
  // Makes the first variables basic. The caller then fills in columns() and right().
  void Reset();
  auto columns() { return values_.leftCols(columns_); }
  auto right() { return values_.col(columns_); }
  auto right() const { return values_.col(columns_); }

  Index basic(Index row) const { return basic_[row]; }                 // the variable that is basic in a row
  Index column_of(Index variable) const { return column_[variable]; }  // kNone where it is basic
  double entry(Index row, Index column) const { return values_(row, column); }

  // The variable of the column becomes basic in the row. The column then is that of the variable that was basic.
  void Pivot(Index row, Index column);

  // The row in which the basic variable falls to zero first as the variable of a column grows; kNone where it may grow
  // without end. Entries below `zero` times the largest of their column do not become pivots. Where `wanted` is among
  // those that fall to zero together, it is taken; among others `rule` decides, by the lexicographic order with respect
  // to the basis of the last Keep() or Reset().
  Index RatioTest(Index column, double zero, LemkeTies rule, Index wanted);

  // The lexicographic order is that with respect to the present basis from now on.
  void Keep() { first_ = basic_; }

 private:
  void BreakTie(Index column);

  Index columns_;
  Values values_;                // the nonbasic columns and the right-hand side, rows filled up with zeros
  std::vector<Index> basic_;     // the variable that is basic in a row
  std::vector<Index> first_;     // the variable that was, at the start of the path
  std::vector<Index> nonbasic_;  // the variable of a column
  std::vector<Index> column_;    // of a variable, or kNone
  std::vector<Index> ties_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_PIVOT_TABLEAU_H_
