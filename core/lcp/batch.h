// SPDX-License-Identifier: Apache-2.0
// Many LCPs with one matrix, in parallel over their right-hand sides.

#ifndef DLCS_CORE_LCP_BATCH_H_
#define DLCS_CORE_LCP_BATCH_H_

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/lcp/lcp.h"
#include "core/lcp/structured/policy_iteration.h"
#include "core/parallel/parallel.h"

namespace dlcs {

// Keeps objects that are expensive to construct for later use; there are never more than were in use at one time. Safe
// to share between threads. Which object a caller gets is not deterministic, so results must not depend on what an
// object was used for before.
template <typename T>
class Pool {
 public:
  // An object that was returned earlier, or a new one from `make`, which returns a std::unique_ptr<T>.
  template <typename Make>
  std::unique_ptr<T> Take(Make&& make) {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<T> taken = std::move(idle_.back());
        idle_.pop_back();
        return taken;
      }
    }
    return make();
  }

  void Return(std::unique_ptr<T> object) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(object));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

struct LcpBatchOutcome {
  LcpStatus verdict = LcpStatus::kSolved;  // of the first column that failed
  Index column = 0;
  bool cancelled = false;
};

// Solves LCP(q_j, M) for the columns q_j of a matrix. Neighboring columns are neighboring times. A tridiagonal M-matrix
// is solved for sixteen columns side by side (core/lcp/structured/policy_iteration.h), others column by column; either
// way each column starts from its own guess and does not depend on the others, so the bits depend neither on the
// threads nor on which columns are solved together.
class LcpBatch {
 public:
  LcpBatch(const Matrix& M, const SolutionChoice& choice);

  // `q` is n × W, `tolerance` n as in LcpSolver::Solve(). `y` (n × W): in a guess, whose positive entries are the
  // initial bases; out the solutions, valid only if the outcome is kSolved. `stop` is checked once per column or per
  // sixteen columns.
  LcpBatchOutcome Solve(const Eigen::Ref<const Matrix>& q, const Eigen::Ref<const Vector>& tolerance, Workers& workers,
                        const std::stop_token& stop, Eigen::Ref<Matrix> y);

 private:
  // The solver and work space of one thread, kept between calls since a solver is expensive to construct.
  struct Bench {
    std::unique_ptr<LcpSolver> solver;
    std::optional<PolicyLanes> lanes;
    Basis basis;
  };

  std::unique_ptr<Bench> MakeBench() const;
  void SolveBlock(Index begin, Index end, const Eigen::Ref<const Matrix>& q, const Eigen::Ref<const Vector>& tolerance,
                  const std::stop_token& stop, Eigen::Ref<Matrix> y, LcpBatchOutcome& outcome);

  std::unique_ptr<LcpSolver> prototype_;
  std::optional<Tridiagonal> diagonals_;  // of M, where lanes serve
  Pool<Bench> benches_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BATCH_H_
