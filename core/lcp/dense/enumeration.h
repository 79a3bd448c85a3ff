// SPDX-License-Identifier: Apache-2.0
// All complementary bases, one after the other.

#ifndef DLCS_CORE_LCP_DENSE_ENUMERATION_H_
#define DLCS_CORE_LCP_DENSE_ENUMERATION_H_

#include <functional>
#include <vector>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/dense/feasibility.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {

inline constexpr Index kMaxEnumerationSize = kMaxSolutionEnumeration;

// Index i is basic when bit i of `subset` is set.
Basis BasisOf(unsigned subset, Index n);

// Whether a solution with the support in S exists: y_S >= 0, y = 0 elsewhere, w_S = 0, w >= 0, for M and q as they
// stand, in exact arithmetic. Unknown where the entries are too far apart in size.
FeasiblePoint SolveFaceExactly(const Matrix& M, const Vector& q, const std::vector<Index>& S);

// Looks at all 2ⁿ complementary bases of `lcp`, n <= kMaxEnumerationSize, in a fixed order: the empty one
// first, then as binary numbers with index 0 the lowest bit. Ends at the first solution that `preferred`
// accepts; when it accepts none, takes the first solution.
//
// A solution whose M_SS is singular belongs to no complementary basis. Where no basis solves, the systems
// M_SS y_S = -q_S, y_S >= 0, w >= 0 of the singular ones are decided as linear programs, so that kInfeasible
// is a proof to working precision: no y at all solves the LCP (although q + M y >= 0 may be possible). Where rounding
// could decide, and no tolerance is given, exact arithmetic does.
//
// kSolved: `basis` and `y` (caller's units) hold the solution. kInfeasible: there is none. kSingular: no solution
// found, and a basis is too close to singular to exclude one. `point` must have been made for Elimination::kPivoting.
LcpStatus Enumerate(const ScaledLcp& lcp, const std::function<bool(const Basis&)>& preferred, BasisPoint& point,
                    Basis& basis, Eigen::Ref<Vector> y);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_ENUMERATION_H_
