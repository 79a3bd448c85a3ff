// SPDX-License-Identifier: Apache-2.0
// Lemke's complementary pivoting.

#ifndef DLCS_CORE_LCP_DENSE_LEMKE_H_
#define DLCS_CORE_LCP_DENSE_LEMKE_H_

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/basis/scaled_lcp.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/pivot_tableau.h"

namespace dlcs {

enum class LemkeEnd { kBasis, kRay, kPivotLimit };

// Follows the path of w - M y - e z₀ = q from z₀ = ∞ with a dense tableau of the nonbasic columns; ties in the ratio
// test are broken lexicographically, so it cannot cycle. Finds a solution wherever there is one if M is a P-matrix,
// positive semidefinite (copositive-plus) or strictly semicopositive, and for many other matrices.
//
// Source: [Cottle, Pang & Stone 1992] R. W. Cottle, J.-S. Pang, R. E. Stone. The linear complementarity
// problem.
//         Academic Press. Algorithm 4.4.5, lexicographic rule (4.9).
//
// Work space for n is allocated once, n² numbers; a pivot costs 2n² operations and a solve typically takes n to
// 3n of them. Not safe to share between threads.
class Lemke {
 public:
  explicit Lemke(Index n);
  Lemke(const Lemke& other) : Lemke(other.n_) {}  // work space for problems of the same size

  // Entries of the tableau below `zero` times the largest of their column do not become pivots. kBasis: `basis` holds a
  // complementary basis that solves the LCP according to the tableau; the caller has to check it. kRay: ray() holds the
  // direction.
  LemkeEnd Run(const ScaledLcp& lcp, double zero, Basis& basis);

  // The same from the solution of `basis` for another q: the path of w - M y - d z₀ = q in which d is 1 for what the
  // basis violates, y_i in it or w_i off it, and `others` >= 0 for the others. kRay if the basis is singular.
  // Where M is of no class, a path that ends in a ray by one rule for ties, or by one d, may lead to a solution by
  // another.
  LemkeEnd Follow(const ScaledLcp& lcp, double zero, double others, LemkeTies rule, Basis& basis);

  // The y-part of the secondary ray, scaled. For copositive-plus M it proves that there is no solution.
  const Vector& ray() const { return ray_; }

  Index pivots() const { return pivots_; }  // of the last Run()

 private:
  void Load(const ScaledLcp& lcp);
  bool Enter(const Basis& basis, double zero);
  LemkeEnd FollowFrom(Index row, double zero, Basis& basis);
  void RecordRay(Index entering);

  Index n_;
  PivotTableau tableau_;  // variables are w (n), y (n) and z₀
  Vector ray_;
  LemkeTies rule_ = LemkeTies::kLexicographic;
  Index pivots_ = 0;
};

// Calls `follow(zero)`, which runs Lemke's method with this `zero` and checks afresh where it ends, with one value
// after the other until it returns true. Returns whether it did. The tableau drifts, so rounding may end a path that
// leads further with another threshold. 1e-11 is above the rounding of most tableaus. 1e-8 is above that of one that
// has drifted, and 1e-14 finds pivots that are as small.
template <typename Follow>
bool FollowWithRetries(const Follow& follow) {
  return follow(kWorkingPrecision) || follow(1e-8) || follow(1e-14);
}

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_LEMKE_H_
