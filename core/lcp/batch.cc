// SPDX-License-Identifier: Apache-2.0

#include "core/lcp/batch.h"

#include <algorithm>

namespace dlcs {
namespace {

// Columns per block: enough to pay for a solver, few enough for parallelism in windows of a few hundred
// steps.
constexpr Index kColumnsPerBlock = 32;
// Solvers hold n² numbers and more; long batches get longer blocks instead of more solvers.
constexpr Index kMostBlocks = 256;

}  // namespace

LcpBatch::LcpBatch(const Matrix& M, const SolutionChoice& choice) : prototype_(MakeLcpSolver(M, choice)) {}

LcpBatchOutcome LcpBatch::Solve(const Matrix& q, const Eigen::Ref<const Vector>& tolerance, Workers& workers,
                                const std::stop_token& stop, Eigen::Ref<Matrix> y) {
  const Index n = q.rows();
  const Index columns = q.cols();
  const Index block_size = std::max(kColumnsPerBlock, (columns + kMostBlocks - 1) / kMostBlocks);
  const Index blocks = (columns + block_size - 1) / block_size;
  std::vector<LcpBatchOutcome> outcomes(blocks);

  workers.ForBlocks(columns, block_size, [&](Index block, Index begin, Index end) {
    LcpBatchOutcome& outcome = outcomes[block];
    const std::unique_ptr<LcpSolver> solver = prototype_->Clone();
    Basis basis(n);
    for (Index j = begin; j < end; ++j) {
      if (stop.stop_requested()) {
        outcome.cancelled = true;
        return;
      }
      for (Index i = 0; i < n; ++i) basis[i] = y(i, j) > 0;
      const LcpVerdict verdict = solver->Solve(q.col(j), tolerance, basis, y.col(j));
      if (verdict != LcpVerdict::kSolved) {
        outcome.verdict = verdict;
        outcome.column = j;
        return;
      }
    }
  });

  LcpBatchOutcome first;
  for (const LcpBatchOutcome& outcome : outcomes) {
    first.cancelled = first.cancelled || outcome.cancelled;
    if (first.verdict == LcpVerdict::kSolved && outcome.verdict != LcpVerdict::kSolved) {
      first.verdict = outcome.verdict;
      first.column = outcome.column;
    }
  }
  return first;
}

}  // namespace dlcs
