// SPDX-License-Identifier: Apache-2.0
// The last digits of a solution.

#ifndef DLCS_CORE_LCP_BASIS_POLISH_H_
#define DLCS_CORE_LCP_BASIS_POLISH_H_

#include "core/types.h"

namespace dlcs {

// Refines a solution `y` of LCP(q, M) that is right to rounding in each row. What rounding left of zeros, y_i that no w
// tells from zero, becomes zero; of J = { i : y_i > 0 } the equations w_J = 0 are solved anew with residuals in longer
// numbers, so that each component is right to rounding in its own size, whatever the condition of M_JJ (below 1e12).
// `y` stays as it is where that moves it by more than rounding could. Cost: |J|³.
void PolishSolution(const Matrix& M, const Vector& q, Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_POLISH_H_
