// SPDX-License-Identifier: Apache-2.0

#include "core/lcp/batch.h"

#include <algorithm>
#include <utility>

#include "core/lcp/structured/tridiagonal_solver.h"

namespace dlcs {
namespace {

// Columns per block: enough to pay for a solver, few enough for parallelism in windows of a few hundred
// steps.
constexpr Index kColumnsPerBlock = 32;
// Solvers hold n² numbers and more; long batches get longer blocks instead of more solvers.
constexpr Index kMaxBlocks = 256;

}  // namespace

LcpBatch::LcpBatch(const Matrix& M, const SolutionChoice& choice)
    : prototype_(MakeLcpSolver(M, choice)), diagonals_(DiagonalsForPolicyIteration(M, choice)) {}

std::unique_ptr<LcpBatch::Bench> LcpBatch::MakeBench() const {
  auto bench = std::make_unique<Bench>();
  bench->solver = prototype_->Clone();
  if (diagonals_) bench->lanes.emplace(diagonals_->size());
  return bench;
}

LcpBatchOutcome LcpBatch::Solve(const Eigen::Ref<const Matrix>& q, const Eigen::Ref<const Vector>& tolerance,
                                Workers& workers, const std::stop_token& stop, Eigen::Ref<Matrix> y) {
  const Index columns = q.cols();
  const Index block_size = std::max(kColumnsPerBlock, (columns + kMaxBlocks - 1) / kMaxBlocks);
  const Index blocks = (columns + block_size - 1) / block_size;
  std::vector<LcpBatchOutcome> outcomes(blocks);

  workers.ForBlocks(columns, block_size, [&](Index block, Index begin, Index end) {
    SolveBlock(begin, end, q, tolerance, stop, y, outcomes[block]);
  });

  LcpBatchOutcome first;
  for (const LcpBatchOutcome& outcome : outcomes) {
    first.cancelled = first.cancelled || outcome.cancelled;
    if (first.verdict == LcpStatus::kSolved && outcome.verdict != LcpStatus::kSolved) {
      first.verdict = outcome.verdict;
      first.column = outcome.column;
    }
  }
  return first;
}

void LcpBatch::SolveBlock(Index begin, Index end, const Eigen::Ref<const Matrix>& q,
                          const Eigen::Ref<const Vector>& tolerance, const std::stop_token& stop, Eigen::Ref<Matrix> y,
                          LcpBatchOutcome& outcome) {
  std::unique_ptr<Bench> bench = benches_.Take([this] { return MakeBench(); });
  auto& [solver, lanes, basis] = *bench;
  const Index group = lanes ? PolicyLanes::kLanes : 1;
  for (Index first = begin; first < end && outcome.verdict == LcpStatus::kSolved; first += group) {
    const Index count = std::min(group, end - first);
    if (stop.stop_requested()) {
      outcome.cancelled = true;
      break;
    }
    const std::uint32_t solved =
        lanes ? lanes->Solve(*diagonals_, q.middleCols(first, count), tolerance, y.middleCols(first, count)) : 0;
    for (Index j = first; j < first + count && outcome.verdict == LcpStatus::kSolved; ++j) {
      if (solved >> (j - first) & 1) continue;
      basis.resize(q.rows());
      for (Index i = 0; i < q.rows(); ++i) basis[i] = y(i, j) > 0;
      outcome.verdict = solver->Solve(q.col(j), tolerance, basis, y.col(j));
      outcome.column = j;
    }
  }
  benches_.Return(std::move(bench));
}

}  // namespace dlcs
