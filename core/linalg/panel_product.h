// SPDX-License-Identifier: Apache-2.0
// Products of large matrices that can be stopped.

#ifndef DLCS_CORE_LINALG_PANEL_PRODUCT_H_
#define DLCS_CORE_LINALG_PANEL_PRODUCT_H_

#include <algorithm>

#include "core/parallel/stop_scope.h"
#include "core/types.h"

namespace dlcs {

// Calls body(begin, count) for the columns [0, columns) panel by panel, each of about ten milliseconds where a column costs
// `operations` multiplications, and looks for a stop (core/parallel/stop_scope.h) before each. Panels depend on the arguments
// alone, and so do the bits of what is made in them.
template <class Body>
void ForPanels(Index columns, Index operations, const Body& body) {
  constexpr Index kOperations = Index{1} << 25;
  constexpr Index kNarrowest = 16;  // below, a product costs more than its numbers
  const Index panel = std::max(kNarrowest, kOperations / std::max<Index>(1, operations));
  for (Index begin = 0; begin < columns; begin += panel) {
    LookForStop();
    body(begin, std::min(panel, columns - begin));
  }
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
