// SPDX-License-Identifier: Apache-2.0
// The coupled step with a Z-matrix: y is the least element of LCP(q + K y, M).

#ifndef DLCS_CORE_LCP_DENSE_COUPLED_LEAST_ELEMENT_H_
#define DLCS_CORE_LCP_DENSE_COUPLED_LEAST_ELEMENT_H_

#include <memory>
#include <string>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/dense/complementary_solver.h"
#include "core/lcp/dense/least_element.h"

namespace dlcs {

// Solves y = SOL(q + K y, M) with SOL the least element, by the generalized Newton method: with the basis S
// of the last least element, y_S = -(M + K)_SS⁻¹ q_S, then S becomes the basis of the least element of LCP(q
// + K y, M), until it repeats itself. A guess that is right costs one check with kept factors.
//
// Where Newton's method does not end (or meets an infeasible LCP, which proves nothing about LCP(q, M + K)):
// Chandrasekaran's method if M + K is a Z-matrix, then ComplementarySolver, which prefers solutions that are least
// elements with respect to M. A solution that is not the least element is returned only if no other was found.
//
// Source: [Chen & Xiang 2013] X. Chen, S. Xiang. Newton iterations in implicit time-stepping scheme for
//         differential linear complementarity systems. Math. Programming 138, 579-606, (3.3).
class CoupledLeastElementSolver final : public LcpSolver {
 public:
  CoupledLeastElementSolver(const Matrix& M, const Matrix& K);
  CoupledLeastElementSolver(const CoupledLeastElementSolver& other);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  bool KeptSelection() const override { return kept_selection_; }
  LcpStats Account() const override;
  std::unique_ptr<LcpSolver> Clone() const override;

 private:
  // Whether the point of `basis` in LCP(q, M + K) is the least element of LCP(q + K y, M): M_SS is a
  // nonsingular M-matrix.
  bool IsLeast(const Basis& basis) { return m_factor_.Factor(M_, basis); }
  bool TryBasis(const Basis& basis, Eigen::Ref<Vector> y);
  bool Newton(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
              Eigen::Ref<Vector> y);
  LcpStatus Fallback(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                     Eigen::Ref<Vector> y);

  Matrix M_;
  Matrix K_;
  ScaledLcp coupled_;  // LCP(q, M + K)
  BasisPoint point_;
  BasisFactor m_factor_;
  LeastElementSolver least_;                           // of M
  std::unique_ptr<LeastElementSolver> coupled_least_;  // of M + K, where that is a Z-matrix
  ComplementarySolver any_;                            // of M + K
  Vector shifted_q_;
  Vector newton_y_;
  Basis next_;
  LcpStats account_;
  bool kept_selection_ = true;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_COUPLED_LEAST_ELEMENT_H_
