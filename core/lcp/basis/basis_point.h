// SPDX-License-Identifier: Apache-2.0
// The point that belongs to a basis, and whether it solves the LCP.

#ifndef DLCS_CORE_LCP_BASIS_BASIS_POINT_H_
#define DLCS_CORE_LCP_BASIS_BASIS_POINT_H_

#include <cstdint>
#include <limits>
#include <vector>

#include "core/lcp/basis/basis_factor.h"
#include "core/lcp/basis/scaled_lcp.h"

namespace dlcs {

// The rounding in a sum of so many products that comes from underflow, a few of the smallest numbers.
inline double UnderflowIn(Index products) {
  return 4 * std::numeric_limits<double>::denorm_min() * static_cast<double>(products + 1);
}

// Fills `violations` with the indices, increasing, of a negative y_i (in S; `y_of_S` in that order) that is not
// negligible(i, y_i), or of a w_i < -allowed_i (not in S).
template <typename Negligible>
void FindViolations(const Basis& basis, const Vector& y_of_S, const Vector& w, const Vector& allowed,
                    const Negligible& negligible, std::vector<Index>& violations) {
  Index p = 0;
  for (Index i = 0; i < w.size(); ++i) {
    if (basis[i]) {
      const double value = y_of_S[p++];
      if (value < 0 && !negligible(i, value)) violations.push_back(i);
    } else if (w[i] < -allowed[i]) {
      violations.push_back(i);
    }
  }
}

// For a basis S: y_S = -M_SS⁻¹ q_S, y = 0 elsewhere, w = q + M y. This is the certificate of every solver in this
// folder: a solution is returned only if it was computed and checked here from M and q themselves. If there are no
// violations and accurate() holds, the LCP is solved.
//
// What counts as zero. w_i may be negative by the caller's tolerance and the rounding of its own sum,
//     allowed_i = tolerance_i + 1e-14 (|q_i| + Σ_j|M_ij||y_j|),
// relative to its own terms only, so that rows and columns may have any units (but for underflow). y_j may be negative
// if setting it to zero changes no w_i by more than allowed_i, so y needs no tolerance of its own. If the point is not
// a solution by these rules, but some y_j are so small relative to the others that they may be rounding errors of
// zeros, these are set to zero and the point is checked again.
class BasisPoint {
 public:
  BasisPoint(const ScaledLcp& lcp, Elimination elimination);

  // False when the basis has no point: M_SS is singular, or (kMMatrix) not a nonsingular M-matrix, or the
  // numbers overflow. `lcp` must have the matrix of the constructor. Allocates only when the basis changed.
  bool Compute(const ScaledLcp& lcp, const Basis& basis);

  // Indices, increasing, with a negative y_i (in S) or a negative w_i (not in S).
  const std::vector<Index>& violations() const { return violations_; }

  // Whether w_S is zero to the same accuracy (after one step of iterative refinement where it was needed).
  bool accurate() const { return accurate_; }

  bool solved() const { return violations_.empty() && accurate_; }

  // If the point is not a solution: whether rounding alone may be the reason, so that the basis proves nothing. The
  // violations are compared with the rounding of y, |M_SS⁻¹| (|M_SS||y| + |q_S|). Cost: up to |S|³ operations.
  bool AreWithinRounding(const ScaledLcp& lcp, const Basis& basis);
  // The same, only if the violations are tiny beside the largest y_j as well.
  bool IsDoubtful(const ScaledLcp& lcp, const Basis& basis);

  const std::vector<Index>& indices() const { return factor_.indices(); }  // S, increasing
  double y(Index position) const { return y_[position]; }                  // y of indices()[position], scaled
  double w(Index i) const { return w_[i]; }                                // scaled
  bool is_positive(Index i) const { return w_[i] > allowed_[i]; }          // w_i, beyond rounding
  // Whether setting y_j = `value` to zero changes every w_i by no more than is allowed.
  bool Negligible(const ScaledLcp& lcp, Index j, double value);

  // Writes y >= 0 in the caller's units.
  void Write(const ScaledLcp& lcp, Eigen::Ref<Vector> y) const;

 private:
  bool Evaluate(const ScaledLcp& lcp);
  void FindOwnViolations(const ScaledLcp& lcp, const Basis& basis);
  void CutNoise(const ScaledLcp& lcp, const Basis& basis);
  double Allowed(const ScaledLcp& lcp, Index i);
  bool AreViolationsWithin(const ScaledLcp& lcp, const Basis& basis, double part, const Vector& size_of_y) const;
  double SizeOfProduct(const ScaledLcp& lcp, Index i) const;  // Σ_j |M_ij y_j|

  BasisFactor factor_;
  Vector y_;      // the first indices().size() entries
  Vector other_;  // a correction of y, or a copy
  Vector w_;
  Vector allowed_;  // without the term Σ|M_ij||y_j| while is_summed_[i] = 0, since few rows need it
  std::vector<std::uint8_t> is_summed_;
  std::vector<Index> violations_;
  bool accurate_ = false;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_BASIS_POINT_H_
