// SPDX-License-Identifier: Apache-2.0
// LCP(q, K) for a dense K whose entries decay away from the diagonal.

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

// Splits the square matrix `K`, if its entries in the band, without positive ones off the diagonal (which belong to R),
// are clearly those of an M-matrix B', and if the rate is at most `largest_rate` < 1. Then K is an H-matrix with a
// positive diagonal, so its LCP has one solution. Otherwise absent; also if the diagonal shows that rows or columns
// have different units, since rounding in one row may then be significant in another. The band is as narrow as a rate
// of 3e-4 allows. B is B' with the sum of the omitted entries of each row added to the diagonal, so that B and K agree
// on constant vectors, where B' and K differ most. Cost: n² and a few n b².
std::optional<BandSplitting> SplitOffBand(const Matrix& K, double largest_rate = 0.5);

enum class SplittingVerdict {
  kSolved,
  kNotContracting,  // the residual does not decrease, or too slowly: use another solver
  kFailed,          // q is not finite, or numbers overflowed
};

// The LCP of a coupled step has the matrix M + K_0, which is dense even if M is tridiagonal. But the entries of K_0
// decay away from the diagonal if diffusion during one step h only reaches neighboring constraints. Policy iteration
// (semismooth Newton) with an approximate inverse: for the basis S of y, w = q + K y,
//
//     y_S <- max(0, y_S - B_SS⁻¹ w_S),
//
// and an index leaves S if y_i = 0 < w_i, and enters it if w_i < 0. S hardly changes from one step to the next, and the
// factors of B_SS before the first changed index are used again. From an extrapolated guess it takes two to four
// rounds, each a product with K and 4 n b operations. It ends with a certificate for K itself: y >= 0 exactly, and w_i
// >= 0 outside S and w_i = 0 in S, up to
//     tolerance_i + 1e-14 (|q_i| + |Σ_j K_ij y_j - 2 K_ii y_i|),
// which is at most 1e-14 times the absolute values of the terms of w_i, with equality if K_ij <= 0 off the diagonal.
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
    bool moved = false;  // S changed
    bool solved = true;
    bool finite = true;
    double residual = 0;  // ‖w_S‖_∞
  };
  // Checks y_ and w_, and updates the basis.
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
