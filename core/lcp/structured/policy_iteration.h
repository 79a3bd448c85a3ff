// SPDX-License-Identifier: Apache-2.0
// LCP(q, M) for a tridiagonal M-matrix, one at a time or sixteen side by side.

#ifndef DLCS_CORE_LCP_STRUCTURED_POLICY_ITERATION_H_
#define DLCS_CORE_LCP_STRUCTURED_POLICY_ITERATION_H_

#include <cstdint>
#include <vector>

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/structured/tridiagonal.h"

namespace dlcs {

// Policy iteration (Howard's method, Newton's method on min(y, q + M y) = 0). With the basis S, solve M_SS y_S = -q_S
// and set to zero what is negative; with w = q + M y the indices with w_i < 0 enter S, those with y_i = 0 < w_i leave
// it, all at once. For an M-matrix y is at most the solution, whatever S, so what enters belongs there. A guess that is
// wrong in a few indices takes two or three rounds. From a bad guess S may grow by one index per round, so the
// iteration gives up after kPatience rounds, and GrowLeastBasis() is used instead. A round costs a division for each
// index of S and about 25 n operations.
//
// What counts as zero: w_i may be negative, and where y_i > 0 differ from zero, by `tolerance`_i and the
// rounding of its own sum,
//     allowed_i = tolerance_i + 1e-14 (|q_i| + |M_{i,i-1} y_{i-1}| + |M_ii y_i| + |M_{i,i+1} y_{i+1}|).
// An elimination in an M-matrix has a backward error of a few units of rounding in each entry, so the
// equations of S hold to that accuracy unless numbers overflow. y >= 0 holds exactly.
//
// `M` must be what IsClearlyMMatrix() asks for. Numbers that overflow, or are not finite, are not solved
// here.
//
// Source: [Bokanowski, Maroso & Zidani 2009] O. Bokanowski, S. Maroso, H. Zidani. Some convergence results
//         for Howard's algorithm. SIAM J. Numerical Analysis 47(4), 3001-3026.
class PolicyIteration {
 public:
  static constexpr int kPatience = 12;

  explicit PolicyIteration(Index n) : ratio_(n), inverse_(n) {}

  // Solves from `basis`, which ends as that of the solution; adds the indices that changed sides to `pivots`.
  // False, with neither `basis` nor `y` of use, where it is not solved. All arrays have n entries.
  bool Solve(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
             Basis& basis, Eigen::Ref<Vector> y, Index& pivots);
  // The same with the M of the previous call. If the basis is the last one of that call, its pivots are used again,
  // which saves half of the time.
  bool SolveAgain(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                  Basis& basis, Eigen::Ref<Vector> y, Index& pivots);

 private:
  std::vector<double> ratio_;    // M_{i,i+1} over the pivot of i, for i in S
  std::vector<double> inverse_;  // 1 over the pivot
  Basis factored_;               // the basis of these pivots; empty: none
};

// The same for sixteen right-hand sides in the lanes of vector registers. Each lane goes through the operations of
// PolicyIteration in their order, in IEEE arithmetic, without contraction: so its bits are the same, whatever is in the
// other lanes and however wide the registers of the processor are. The instruction set is chosen at run time (x86-64:
// AVX-512, AVX2 or the baseline).
class PolicyLanes {
 public:
  static constexpr Index kLanes = 16;

  explicit PolicyLanes(Index n) : q_(n), y_(n), ratio_(n), basic_(n) {}

  // Solves LCP(q_j, M) for the `columns` <= kLanes columns of `q` from the bases { i : y(i, j) > 0 }, and
  // writes the solutions to `y`. Bit j of the result tells whether column j was solved; the others of `y` are
  // left as they are.
  std::uint32_t Solve(const Tridiagonal& M, const Eigen::Ref<const Matrix>& q,
                      const Eigen::Ref<const Vector>& tolerance, Eigen::Ref<Matrix> y);

 private:
  struct alignas(64) Row {
    double lane[kLanes];
  };
  struct alignas(64) Bits {
    std::int64_t lane[kLanes];  // all bits set: true
  };

  static void ToRows(const Eigen::Ref<const Matrix>& columns, std::vector<Row>& rows);

  std::vector<Row> q_, y_, ratio_;
  std::vector<Bits> basic_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_POLICY_ITERATION_H_
