// SPDX-License-Identifier: Apache-2.0
// The linear complementarity system of index one in its integral form, Lemma 8 of [Shen & Pang 2007].

#ifndef DLCS_TESTS_SUPPORT_RESTRICTED_DCP_H_
#define DLCS_TESTS_SUPPORT_RESTRICTED_DCP_H_

#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "core/analysis/index_one.h"
#include "core/lcp/dynamic_lcp.h"

namespace dlcs {

// x' = A x + B u, 0 <= u ⟂ C x >= 0, x(0) = x0 is, by (12), the restricted-time problem DCP(q + Φ, CB, t̂) for v = ∫u:
//
//     0 <= v' ⟂ C e^{At} x0 + CB v(t) + Φ(t, v') >= 0,     Φ(t, u) = ∫_0^t C(e^{A(t-τ)} - I)B u(τ) dτ.
struct RestrictedDcpSolution {
  bool solved = false;  // v reaches t̂
  std::string message;  // why not, and when
  PiecewiseLinearPath v;
  DcpProblem dcp;              // CB and the path q + Φ(·, v') at the nodes of v, that v belongs to
  DcpCertificate certificate;  // of v for `dcp`, between the nodes too; it falls like the step
};

// Solves (12) on [0, t̂] by `steps` equal steps of length h: with v linear on each, v' = z_l/h,
//
//     Φ(t_j, v') = Σ_{l=1..j} F_{j-l} z_l,     F_k = C (e^{khA} φ_1(hA) - I) B   exactly,
//     z_j from LCP(q_j + CB v_{j-1} + Σ_{l<j} F_{j-l} z_l, CB + F_0).
//
// The memory term of (12) is summed directly; no state is stored. First order in v. `solved` is false if an LCP has
// no solution; for strictly semicopositive CB every one has for h <= h̄ of Theorem 7(a). Of several solutions any is
// taken: see TestDcpUniqueness(). Errors: InvalidArgument for shapes, entries that are not finite, t̂ <= 0, steps < 1,
// or C x0 >= 0 not true; Cancelled where `stop`, looked at every step, was requested. Cost: O(steps² n²) + O(steps m²
// n), one LCP a step.
absl::StatusOr<RestrictedDcpSolution> SolveRestrictedDcp(const IndexOneSystem& system, const Vector& x0, double t_hat,
                                                         Index steps, std::stop_token stop = {});

}  // namespace dlcs

#endif  // DLCS_TESTS_SUPPORT_RESTRICTED_DCP_H_
