// SPDX-License-Identifier: Apache-2.0
// An independent solver of linear complementarity problems: linear programming by COIN-OR CLP.

#ifndef DLCS_TESTS_SUPPORT_LCP_LINEAR_PROGRAM_H_
#define DLCS_TESTS_SUPPORT_LCP_LINEAR_PROGRAM_H_

#include <optional>

#include "core/types.h"

namespace dlcs::testing {

// argmin { Σ y_i : y >= 0, q + M y >= 0 }; absent when no y is feasible (to CLP's tolerance of 1e-9).
// For a Z-matrix that is the least element.
std::optional<Vector> MinimizeSumOverFeasible(const Matrix& M, const Vector& q);

// Whether LCP(q, M) has any solution: for every set of active constraints, singular or not, a linear program.
// 2ⁿ of them: for small n.
bool HasSolutionByEnumeration(const Matrix& M, const Vector& q);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_LCP_LINEAR_PROGRAM_H_
