// SPDX-License-Identifier: Apache-2.0
// Products of large matrices that can be stopped.

#ifndef DLCS_CORE_LINALG_PANEL_PRODUCT_H_
#define DLCS_CORE_LINALG_PANEL_PRODUCT_H_

#include <algorithm>

#include "core/parallel/stop_scope.h"
#include "core/types.h"

namespace dlcs {

// The columns that take about ten milliseconds together, where one costs `operations` multiplications.
inline Index PanelWidth(Index operations) {
  constexpr Index kOperations = Index{1} << 25;
  constexpr Index kNarrowest = 16;  // products of narrower panels are less efficient
  return std::max(kNarrowest, kOperations / std::max<Index>(1, operations));
}

// Calls body(begin, count) for the columns [0, columns) panel by panel, each of PanelWidth(operations) columns, and
// checks for a stop (core/parallel/stop_scope.h) before each. Panels depend on the arguments alone, and so do the bits
// of the results.
template <class Body>
void ForPanels(Index columns, Index operations, const Body& body) {
  const Index panel = PanelWidth(operations);
  for (Index begin = 0; begin < columns; begin += panel) {
    LookForStop();
    body(begin, std::min(panel, columns - begin));
  }
}

// sum += left · right, where a column of the product costs `operations` multiplications.
template <class Left>
void AddProduct(const Left& left, Index operations, const Matrix& right, Matrix& sum) {
  ForPanels(right.cols(), operations, [&](Index begin, Index count) {
    sum.middleCols(begin, count).noalias() += left * right.middleCols(begin, count);
  });
}

// left · right.
inline Matrix Product(const Eigen::Ref<const Matrix>& left, const Eigen::Ref<const Matrix>& right) {
  Matrix product(left.rows(), right.cols());
  ForPanels(right.cols(), left.size(), [&](Index begin, Index count) {
    product.middleCols(begin, count).noalias() = left * right.middleCols(begin, count);
  });
  return product;
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PANEL_PRODUCT_H_
