// SPDX-License-Identifier: Apache-2.0
// Is there any y >= 0 with c + C y >= 0?

#ifndef DLCS_CORE_LCP_DENSE_FEASIBILITY_H_
#define DLCS_CORE_LCP_DENSE_FEASIBILITY_H_

#include "core/lcp/basis/scaled_lcp.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/bounded_sum.h"
#include "core/types.h"

namespace dlcs {

enum class Feasibility { kFeasible, kInfeasible, kUnknown };

struct FeasiblePoint {
  Feasibility answer = Feasibility::kUnknown;
  Vector y;  // when feasible: y >= 0 with c + C y >= -tolerance beyond rounding
};

// Decides whether { y >= 0 : c + C y >= 0 } is empty, by Lemke's method on the skew-symmetric LCP of the linear program
// with zero costs, `tolerance` as in LcpSolver::Solve(); an empty set is proven by λ >= 0 with Cᵀλ <= 0 and cᵀλ < 0
// (Farkas). Entries of Cᵀλ up to `rounding` times their terms count as zero: a y that is as large as their inverse may
// still be a point of the set. Where the answer is final that is kWorkingPrecision (core/lcp/basis/tolerance.h), and
// where another method decides what is left unknown, enumeration or exact arithmetic, kFewUlps. `C` is r × k, any
// shape. Cost: (r + k)³; not for the inner loop.
FeasiblePoint FindFeasiblePoint(const Matrix& C, const Vector& c, const Vector& tolerance, double rounding);
inline constexpr double kFewUlps = RoundingOf(32);

// Whether the y-part of a secondary `ray`, taken for multipliers of the rows, proves to working precision that no y >=
// 0 has q + M y >= 0: λ >= 0 (negative entries are cut), Mᵀλ <= 0 and qᵀλ < 0 beyond the rounding of these sums and the
// tolerance of `lcp`. y_i is a multiplier of row i in the caller's units if row i and column i have the same unit, and
// otherwise in the units of `lcp`; both are tried.
bool ProvesInfeasible(const ScaledLcp& lcp, const Eigen::Ref<const Vector>& ray);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_FEASIBILITY_H_
