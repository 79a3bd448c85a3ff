// SPDX-License-Identifier: Apache-2.0
// The Lipschitz constant of the solution of LCP(q, M) as a function of q.

#ifndef DLCS_CORE_ANALYSIS_LIPSCHITZ_H_
#define DLCS_CORE_ANALYSIS_LIPSCHITZ_H_

#include <optional>

#include "core/types.h"

namespace dlcs {

// L = max ‖(M_SS)⁻¹‖_∞ over the nonsingular principal submatrices of M, 0 if there is none: (2.3) of
// [Chen & Xiang 2013] X. Chen, S. Xiang. Newton iterations in implicit time-stepping scheme for differential
// linear complementarity systems. Math. Programming 138, 579-606.
//
// Exact for n <= 12 (2ⁿ inverses) and for M-matrices (L = ‖M⁻¹‖_∞). Beyond, an upper bound: for an H-matrix
// with positive diagonal ‖⟨M⟩⁻¹‖_∞ with ⟨M⟩ the comparison matrix; for a positive definite symmetric part
// √n / λ_min. Otherwise absent.
std::optional<double> LipschitzConstant(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_LIPSCHITZ_H_
