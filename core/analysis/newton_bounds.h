// SPDX-License-Identifier: Apache-2.0
// How long a step may be, and how far a solution is sure to reach.

#ifndef DLCS_CORE_ANALYSIS_NEWTON_BOUNDS_H_
#define DLCS_CORE_ANALYSIS_NEWTON_BOUNDS_H_

#include <optional>

#include "core/problem.h"

namespace dlcs {

// κ = ‖A‖ + 𝓛‖B‖‖N‖ in the norm ‖·‖_∞: the right-hand side A x + B y(N x + g) + f is Lipschitz in x with κ, where y
// is with `lipschitz`; absent where that is. With a step h < 1/κ, H of (3.1) is a contraction with the rate hκ
// (Lemma 3.1 of [Chen & Xiang 2013]), and with h < 1/(3κ) Newton's method converges (Theorem 3.2).
std::optional<double> RightHandSideLipschitz(const Problem& problem, const std::optional<double>& lipschitz);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_NEWTON_BOUNDS_H_
