// SPDX-License-Identifier: Apache-2.0
// The method of Lemke and Howson for bimatrix games.

#ifndef DLCS_CORE_LCP_DENSE_LEMKE_HOWSON_H_
#define DLCS_CORE_LCP_DENSE_LEMKE_HOWSON_H_

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/dense/pivot_tableau.h"

namespace dlcs {

// Finds an equilibrium of the game in which the first player pays R_ij and the second C_ij, i.e. y = (u, v) with
//
//     0 <= u  ⟂  R v - 1 >= 0,      0 <= v  ⟂  Cᵀu - 1 >= 0,
//
// where R and C, both m × n, have positive entries. Strategies are numbered from 0 to m + n - 1, those of the first
// player first.
//
// Each strategy k has a path of complementary pivots from every equilibrium to another one: y_k w_k may be positive on
// it, all other products are zero. The first path begins with u (or v) zero but for y_k, which is large. Ties are
// broken lexicographically, so in exact arithmetic no path cycles, of degenerate games either, and those from the begin
// do not end in a ray. Random games of 100 x 100 strategies take some hundreds of pivots, sometimes thousands; there
// are games whose paths are all exponential in their size.
//
// Source: [Lemke & Howson 1964] C. E. Lemke, J. T. Howson. Equilibrium points of bimatrix games. J. SIAM 12, 413-423.
//         [Cottle, Pang & Stone 1992] R. W. Cottle, J.-S. Pang, R. E. Stone. The linear complementarity problem.
//         Academic Press. Section 1.2 (the LCP of a game), 4.4 (the method); the lexicographic rule is (4.9).
class LemkeHowson {
 public:
  LemkeHowson(const Matrix& R, const Matrix& C);

  enum class End {
    kBasis,
    kRay,  // by rounding, or on a path that leads back to where all begin
    kPivotLimit,
  };

  // Back to where all paths begin.
  void Reset();

  // Follows the path of a strategy, from where the last one ended with kBasis or from the begin. kBasis: basis(), in
  // the order of the strategies, is complementary and solves the LCP according to the tableaus; the caller has to check
  // it. Otherwise only Reset() may follow. Entries of a tableau below `zero` times the largest of their column do not
  // become pivots.
  End Follow(Index strategy, Index max_pivots, double zero);

  const Basis& basis() const { return basis_; }
  Index pivots() const { return pivots_; }  // of the last path

 private:
  // { A y - w = 1, y >= 0, w >= 0 }: A = Cᵀ, y = u and the slack w of v; or A = R, y = v and the slack w of u.
  struct Side {
    explicit Side(const Matrix& A_of_side) : A(A_of_side), tableau(A.rows(), A.cols()) {}

    void Reset();
    // The variable enters. Returns the one that leaves, or kNone.
    Index Exchange(Index entering, double zero, Index wanted);

    Matrix A;
    PivotTableau tableau;
    bool is_feasible = false;  // the first exchange makes it so
  };

  // The variable of a side with the number of a strategy: y_k on one side is w_k on the other.
  Index VariableOf(bool of_u, Index strategy) const;
  Index StrategyOf(bool of_u, Index variable) const;

  Index m_, n_;
  Side u_, v_;
  Basis basis_;
  Index pivots_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_LEMKE_HOWSON_H_
