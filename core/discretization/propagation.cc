// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/propagation.h"

#include "core/linalg/panel_product.h"

namespace dlcs {

void Propagate(const Scheme& scheme, Segment& segment) {
  const Index operations = 2 * (scheme.f_after.size() + scheme.y_after.size()) + scheme.state.size();
  ForPanels(segment.steps, operations, [&](Index begin, Index count) {
    auto x = segment.x.middleCols(begin + 1, count);
    x.noalias() = scheme.f_before * segment.f.middleCols(begin, count);
    x.noalias() += scheme.f_after * segment.f.middleCols(begin + 1, count);
    x.noalias() += scheme.y_before * segment.y.middleCols(begin, count);
    x.noalias() += scheme.y_after * segment.y.middleCols(begin + 1, count);
    for (Index j = begin + 1; j <= begin + count; ++j) {
      segment.x.col(j).noalias() += scheme.state * segment.x.col(j - 1);
    }
  });
}

}  // namespace dlcs
