// SPDX-License-Identifier: Apache-2.0
// Many LCPs with one matrix, in parallel over their right-hand sides.

#ifndef DLCS_CORE_LCP_BATCH_H_
#define DLCS_CORE_LCP_BATCH_H_

#include <memory>
#include <stop_token>
#include <vector>

#include "core/lcp/lcp.h"
#include "core/parallel/parallel.h"

namespace dlcs {

struct LcpBatchOutcome {
  LcpVerdict verdict = LcpVerdict::kSolved;  // of the first column that failed
  Index column = 0;
  bool cancelled = false;
};

// Solves LCP(q_j, M) for the columns q_j of a matrix. Neighbouring columns are neighbouring times: each block
// of columns is a warm-started sequence with a solver of its own, so the bits do not depend on the threads.
class LcpBatch {
 public:
  LcpBatch(const Matrix& M, const SolutionChoice& choice);

  // `q` is n × W, `tolerance` n as in LcpSolver::Solve(). `y` (n × W) holds a guess, whose positive entries
  // start the bases, and takes the solutions; where the outcome is not kSolved its columns are not to be
  // used. `stop` is looked at once a column.
  LcpBatchOutcome Solve(const Matrix& q, const Eigen::Ref<const Vector>& tolerance, Workers& workers,
                        const std::stop_token& stop, Eigen::Ref<Matrix> y);

 private:
  std::unique_ptr<LcpSolver> prototype_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BATCH_H_
