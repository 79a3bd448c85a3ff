// SPDX-License-Identifier: Apache-2.0
// A solution y(q) of LCP(q, M) as a function of q: index sets, differentiability, generalized Jacobian.

#ifndef DLCS_CORE_LCP_BASIS_SOLUTION_FUNCTION_H_
#define DLCS_CORE_LCP_BASIS_SOLUTION_FUNCTION_H_

#include <optional>
#include <vector>

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// The index sets of a solution y of LCP(q, M), w = q + M y, each increasing:
//
//     J = { i : y_i > 0 },   I = { i : w_i > 0 },   K = { i : y_i = w_i = 0 }.
//
// The print of [Chen & Xiang] defines K by w_i = q_i = 0; its proofs use y_i, and so do we: with q_i, a K
// that is empty would not exclude degenerate solutions (M = -1, q = 1 at y = 1 has q_i != 0 = w_i).
struct IndexSets {
  std::vector<Index> J, I, K;
  bool degenerate() const { return !K.empty(); }
};

// The index sets of the solution `y` >= 0. w_i counts as zero up to 1e-11 (|q_i| + Σ_j|M_ij| y_j), the
// rounding of its sum with room to spare, and y_j where setting it to zero changes no w_i by more than that.
IndexSets FindIndexSets(const Matrix& M, const Vector& q, const Vector& y);

// -(I - D + D M)⁻¹ D with D = diag(1 for i in `J`, else 0): the Jacobian (2.1) of y at q where y is
// differentiable, and an element (2.4) of its Clarke generalized Jacobian elsewhere, for M nondegenerate
// (Theorem 2.1) or a Z-matrix with the least element (Theorem 2.2 iv). By (2.7), (2.9) it is -M_JJ⁻¹ in rows
// and columns J and zero elsewhere. Absent where M_JJ is singular to working precision. Cost: |J|³.
std::optional<Matrix> ClarkeElement(const Matrix& M, const std::vector<Index>& J);

// Whether a continuous solution function is differentiable at q with the solution of these `sets`: exactly
// when it is nondegenerate and M_JJ is nonsingular (Lemma 2.1). The reason names an index of K or the
// singular block.
Fact TestDifferentiable(const Matrix& M, const IndexSets& sets);

// Whether some v > 0 has q + M v > 0: the feasible set has an interior point, condition (4.1). The witness is
// v and value the margin min(v, q + M v) > 0. By one linear program; unknown where the margin is within its
// tolerance.
//
// For positive semidefinite M it means that SOL(q, M) is not empty and bounded, here and nearby. It does not
// mean that a Lipschitz selection exists, as Remark 2.1 (ii) of [Chen & Xiang] has it: for M = [0 1; -1 0]
// and q = (0, 1) the point (1/2, 1/2) is interior, but y = (1, ε) is the only solution for q = (-ε, 1), and y
// = 0 for q = (ε, 1).
Fact TestInteriorPoint(const Matrix& M, const Vector& q);

// Source of all: [Chen & Xiang 2013] X. Chen, S. Xiang. Newton iterations in implicit time-stepping scheme
// for differential linear complementarity systems. Math. Programming 138, 579-606, section 2.

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_SOLUTION_FUNCTION_H_
