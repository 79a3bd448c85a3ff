// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/propagator.h"

namespace dlcs {

void ReducedKernel::AddResponse(const Eigen::Ref<const Matrix>& base, const Eigen::Ref<const Matrix>& y,
                                Workers& workers, ResponseScratch& /*scratch*/, Eigen::Ref<Matrix> q,
                                const OnColumns& computed) const {
  const Matrix response = Respond(y, workers);
  workers.ForBlocks(y.cols(), kColumnsPerBlock, [&](Index, Index begin, Index end) {
    q.middleCols(begin, end - begin) = base.middleCols(begin, end - begin) + response.middleCols(begin, end - begin);
    computed(begin, end);
  });
}

Motion ReducedKernel::MoveThroughout(FreeMotion free, const Eigen::Ref<const Matrix>& y, Workers& workers) const {
  const Index steps = y.cols() - 1;
  Motion motion{.nodes = Start(y.col(0))->History(steps), .middles = RespondAtMiddles(y, workers)};
  motion.nodes += Respond(y.rightCols(steps), workers);
  motion.nodes += free.nodes.middleCols(1, steps);
  motion.middles += free.middles.leftCols(steps);
  return motion;
}

}  // namespace dlcs
