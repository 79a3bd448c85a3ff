// SPDX-License-Identifier: Apache-2.0
// The least solution of LCP(q, M) in the order of pos X, for hidden Z-matrices.

#ifndef DLCS_CORE_LCP_DENSE_HIDDEN_LEAST_ELEMENT_H_
#define DLCS_CORE_LCP_DENSE_HIDDEN_LEAST_ELEMENT_H_

#include <memory>
#include <optional>

#include "core/lcp/dense/complementary_solver.h"
#include "core/linalg/linear_program.h"

namespace dlcs {

// M X = Y with Z-matrices X (nonsingular) and Y, and rᵀX + sᵀY > 0 for some r, s >= 0: (4.10) of [Chen & Xiang]. The
// feasible set { z = X u : X u >= 0, q + Y u >= 0 } has a least u, and z = X u, least in the order of the cone pos X,
// solves the LCP. It is the solution of the linear program (4.11),
//
//     min eᵀX⁻¹z,     z >= 0,     q + M z >= 0.
//
// The paper does not say so, but another X may make another solution the least one (HiddenLeastElementTest.DependsOnX
// has an example): the X meant is that of TestHiddenZ() (core/matrix_classes/hidden_z.h).
//
// The point of a basis S that solves the LCP is that solution where the multipliers of (4.11) are feasible, with
// c = X⁻ᵀe: λ_S = M_SS⁻ᵀ c_S >= 0 and c - Mᵀλ >= 0, λ = 0 elsewhere. They do not depend on q: a guessed basis is
// checked without a linear program. Otherwise CLP solves (4.11), and the point of its basis is computed anew and
// checked.
//
// Source: [Cottle, Pang & Stone 1992] R. W. Cottle, J.-S. Pang, R. E. Stone. The linear complementarity problem.
// Academic Press. Theorems 3.11.17 to 3.11.19.
class HiddenLeastElementSolver final : public LcpSolver {
 public:
  HiddenLeastElementSolver(const Matrix& M, const Matrix& X);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  LcpStats Account() const override { return account_; }
  std::unique_ptr<LcpSolver> Clone() const override { return std::make_unique<HiddenLeastElementSolver>(*this); }

 private:
  bool TryBasis(const Basis& basis, Eigen::Ref<Vector> y);
  bool TryOtherBases(const Vector& q, Basis& basis, Eigen::Ref<Vector> y);
  bool HasFeasibleMultipliers(const Basis& basis) const;

  Matrix M_;
  Vector cost_;  // X⁻ᵀ e, in the units of lcp_
  LinearProgram program_;
  ScaledLcp lcp_;
  BasisPoint point_;
  LcpStats account_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_HIDDEN_LEAST_ELEMENT_H_
