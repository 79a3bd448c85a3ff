// SPDX-License-Identifier: Apache-2.0
#include "core/methods/propagation.h"

namespace dlcs {

void Propagate(const Scheme& scheme, Segment& segment) {
  const Index steps = segment.steps;
  auto x = segment.x.rightCols(steps);
  x.noalias() = scheme.f_before * segment.f.leftCols(steps);
  x.noalias() += scheme.f_after * segment.f.rightCols(steps);
  x.noalias() += scheme.y_before * segment.y.leftCols(steps);
  x.noalias() += scheme.y_after * segment.y.rightCols(steps);
  for (Index j = 1; j <= steps; ++j) segment.x.col(j).noalias() += scheme.state * segment.x.col(j - 1);
}

}  // namespace dlcs
