// SPDX-License-Identifier: Apache-2.0
// Refines the last digits of a solution.

#ifndef DLCS_CORE_LCP_BASIS_POLISH_H_
#define DLCS_CORE_LCP_BASIS_POLISH_H_

#include "core/types.h"

namespace dlcs {

// Refines a solution `y` of LCP(q, M) whose residual is at rounding level in each row. Each y_i so small that setting
// it to zero changes no w by more than rounding becomes zero. With J = { i : y_i > 0 } the equations w_J = 0 are solved
// again with residuals in extended precision, so that each component has a small relative error for any condition of
// M_JJ below 1e12. `y` is not changed if that would move it by more than rounding can explain. Cost: |J|³.
void PolishSolution(const Matrix& M, const Vector& q, Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_POLISH_H_
