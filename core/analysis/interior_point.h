// SPDX-License-Identifier: Apache-2.0
// Whether the feasible set of LCP(q, M) has an interior point.

#ifndef DLCS_CORE_ANALYSIS_INTERIOR_POINT_H_
#define DLCS_CORE_ANALYSIS_INTERIOR_POINT_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Whether some v > 0 has q + M v > 0: (4.1) of [Chen & Xiang 2013] for q = N x0 + g(0).
//
// Yes comes with `witness.z` = v. No comes with `witness.z` = u >= 0, u != 0, Mᵀu <= 0, uᵀq <= 0, which excludes every
// v, since uᵀ(q + M v) <= 0; its inequalities hold up to the rounding of their sums. Unknown where neither can be shown
// in working precision, and for n > kMaxInteriorPoint. `q` n entries, `M` n × n, finite. Cost: up to three linear
// programs of n rows. Thread-safe.
Fact TestInteriorPoint(const Vector& q, const Matrix& M);
inline constexpr Index kMaxInteriorPoint = 200;

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_INTERIOR_POINT_H_
