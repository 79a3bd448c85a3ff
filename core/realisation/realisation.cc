// SPDX-License-Identifier: Apache-2.0
#include "core/realisation/realisation.h"

#include <utility>

namespace dlcs {

void ReducedKernel::AddResponse(const Eigen::Ref<const Matrix>& y, Workers& workers, ResponseScratch& /*scratch*/,
                                Eigen::Ref<Matrix> q) const {
  q += Respond(y, workers);
}

Responses ReducedKernel::RespondThroughout(const Matrix& y, Workers& workers) const {
  const Index steps = y.cols() - 1;
  Matrix nodes = Start(y.col(0))->History(steps);
  nodes += Respond(y.rightCols(steps), workers);
  return {.nodes = std::move(nodes), .middles = RespondAtMiddles(y, workers)};
}

}  // namespace dlcs
