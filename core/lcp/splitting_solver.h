// SPDX-License-Identifier: Apache-2.0
// LCP(q, T + R) with a tridiagonal T and a remainder R that is only applied.

#ifndef DLCS_CORE_LCP_SPLITTING_SOLVER_H_
#define DLCS_CORE_LCP_SPLITTING_SOLVER_H_

#include <functional>
#include <optional>

#include "core/lcp/secants.h"
#include "core/lcp/tridiagonal_solver.h"

namespace dlcs {

enum class SplittingVerdict {
  kSolved,
  kNotContracting,  // the changes do not fall, or not fast enough to be worth it: take another solver
  kFailed,          // a tridiagonal LCP was not solved: q is not finite, or numbers overflowed
};

// The coupled step of a march has the matrix M + K_0, dense although M is tridiagonal; but K_0 falls off
// quickly from its diagonal where h and the diffusion are such that a step sees its neighbours only. Then
//
//     y^{k+1} = SOL(q + R y^k, T)
//
// contracts: |y^{k+1} - y^k| <= T⁻¹|R| |y^k - y^{k-1}| for an M-matrix T. From an extrapolated start two to
// four of these O(n) solves reach rounding. It ends when R y^{k+1} differs from R y^k, with which the last
// LCP was solved, by rounding only, so the certificate is that of the whole matrix:
//     |R y^{k+1} - R y^k|_i <= tolerance_i + 1e-14 (|q_i| + ‖R y‖_∞).
// Where four are not enough, secants (core/lcp/secants.h) guess the next R y^k: R smooths, and its few large singular
// values are soon known.
//
// Source: [Cottle, Pang & Stone 1992], Section 5.2 (matrix splitting methods).
class SplittingLcpSolver {
 public:
  // result = R y; both have n entries. May keep state of its own, but the result must depend on y alone.
  using Remainder = std::function<void(const Vector& y, Vector& result)>;

  // `T` must be what IsClearlyMMatrix() asks for; nothing is asked of R.
  SplittingLcpSolver(Tridiagonal T, Remainder remainder);

  // `q` and `tolerance` as in LcpSolver::Solve(). `y`, n entries: a guess in, of any sign; the solution out,
  // >= 0 exactly, of use with kSolved only. The bits depend on the guess, the solution does not beyond
  // rounding.
  SplittingVerdict Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                         Eigen::Ref<Vector> y);

  Index iterations() const { return iterations_; }  // tridiagonal LCPs of the last Solve()
  // ... and the last ratio of changes of R y while no secants were used; 0 before there are two.
  double rate() const { return rate_; }

 private:
  TridiagonalSolver tridiagonal_;
  Remainder remainder_;
  Basis basis_;
  Vector y_, shifted_q_, lagged_, current_, difference_;
  Secants secants_;
  Index iterations_ = 0;
  double rate_ = 0;
};

// A matrix K as T + R, with R in diagonals.
struct TridiagonalSplitting {
  Tridiagonal T;
  SplittingLcpSolver::Remainder remainder;
  double rate = 0;      // ‖T⁻¹|R|‖_∞, a bound of the contraction
  Index bandwidth = 0;  // of R as it is applied
};

// Splits the square matrix `K` where that serves: T is clearly an M-matrix, and the rate at most
// `largest_rate` < 1. Diagonals of R far from the main one are dropped where no entry is more than 8 ε = 1.8e-15 of its
// row of K: a computed K has rounding there. Cost O(n²); applying R costs 2 n · bandwidth multiplications.
std::optional<TridiagonalSplitting> SplitOffTridiagonal(const Matrix& K, double largest_rate = 0.5);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_SPLITTING_SOLVER_H_
