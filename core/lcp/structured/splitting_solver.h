// SPDX-License-Identifier: Apache-2.0
// LCP(q, K) for a K whose entries fall off from the diagonal.

#ifndef DLCS_CORE_LCP_STRUCTURED_SPLITTING_SOLVER_H_
#define DLCS_CORE_LCP_STRUCTURED_SPLITTING_SOLVER_H_

#include <memory>
#include <optional>

#include "core/lcp/structured/band_factor.h"
#include "core/lcp/structured/band_matrix.h"

namespace dlcs {

// K = B + R with a banded M-matrix B, of which factors are kept, and a remainder R that is only applied.
struct BandSplitting {
  std::shared_ptr<const BandMatrix> B;
  BandProduct product;  // with all of K
  Vector diagonal;      // of K
  double rate = 0;      // ‖B'⁻¹|K - B'|‖_∞ for K's own entries B' in the band
  Index bandwidth = 0;  // of K up to rounding
};

// Splits the square matrix `K` where that serves: its entries in the band of B are clearly those of an M-matrix B' but
// for positive ones off the diagonal, which are left to R, and the rate is at most `largest_rate` < 1. Then K is an
// H-matrix with a positive diagonal, so that its LCP has one solution. Not where the diagonal says that rows or columns
// have units of their own: what is rounding in one may count in another. The band is as narrow as a rate of 3e-4
// allows. B is B' with what is left out of each row added to the diagonal: smooth y, for which B' is least like K, have
// the same image then. Cost: n² and a few n b².
std::optional<BandSplitting> SplitOffBand(const Matrix& K, double largest_rate = 0.5);

enum class SplittingVerdict {
  kSolved,
  kNotContracting,  // the residual does not fall, or not fast enough to be worth it: take another solver
  kFailed,          // q is not finite, or numbers overflowed
};

// The coupled step of a march has the matrix M + K_0, dense although M is tridiagonal; but K_0 falls off from its
// diagonal where h and the diffusion are such that a step sees its neighbors only. Policy iteration (semismooth
// Newton) with an approximate inverse: for the basis S of y, w = q + K y,
//
//     y_S <- max(0, y_S - B_SS⁻¹ w_S),
//
// and indices change sides where y_i = 0 < w_i in S or w_i < 0 beside it. From one step to the next S hardly moves, and
// the factors of B_SS serve again before the first index that has. An extrapolated guess takes two to four rounds,
// each a product with K and 4 n b operations. What ends it is the certificate of K itself: y >= 0 exactly, and w_i >=
// 0, beside S, or = 0, in S, up to
//     tolerance_i + 1e-14 (|q_i| + |Σ_j K_ij y_j - 2 K_ii y_i|),
// which is at most 1e-14 of the numbers that w_i is summed from, and equal to it where K_ij <= 0 off the diagonal.
//
// Source: [Cottle, Pang & Stone 1992], Section 5.2 (matrix splitting methods).
class SplittingLcpSolver {
 public:
  explicit SplittingLcpSolver(BandSplitting splitting);

  // `q` and `tolerance` as in LcpSolver::Solve(). `y`, n entries: a guess in, of any sign; the solution out,
  // >= 0 exactly, of use with kSolved only. The bits depend on the guess, the solution does not beyond rounding;
  // neither depends on earlier solves.
  SplittingVerdict Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                         Eigen::Ref<Vector> y);

  Index iterations() const { return iterations_; }  // products of the last Solve()

 private:
  struct Judgment {
    bool moved = false;  // indices changed sides
    bool solved = true;
    bool finite = true;
    double residual = 0;  // ‖w_S‖_∞
  };
  // Judges y_ by w_, and moves what has to between the sides of the basis.
  Judgment Judge(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance);
  // y_S <- max(0, y_S - B_SS⁻¹ w_S).
  void Correct();

  BandProduct product_;
  Vector diagonal_;
  BandFactor factor_;
  Basis basis_;
  Vector is_basic_;  // the same as 1 or 0, for loops over vectors
  Vector y_, w_;
  Index iterations_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_SPLITTING_SOLVER_H_
