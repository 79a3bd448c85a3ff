// SPDX-License-Identifier: Apache-2.0
// The dynamic complementarity problem DCP(q, M) of Mandelbaum, for piecewise linear q.

#ifndef DLCS_CORE_LCP_DYNAMIC_LCP_H_
#define DLCS_CORE_LCP_DYNAMIC_LCP_H_

#include <limits>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// A function of time, linear between nodes. A time that occurs twice is a jump, with its left and its right limit.
struct PiecewiseLinearPath {
  std::vector<double> times;  // nondecreasing, each at most twice, the first 0
  Matrix values;              // n × times
};

// Find v, nondecreasing with v(0) = 0, such that w = q + M v >= 0 and ∫ w_i dv_i = 0 for every i, on the time
// of q. q(0) >= 0.
struct DcpProblem {
  Matrix M;               // n × n
  PiecewiseLinearPath q;  // jumps of q are those of D^n in [Shen & Pang 2007], section 2
};

// How well a path solves a DCP; exact, since q and v are piecewise linear. At a jump the integrand is w after
// it.
struct DcpCertificate {
  double start = 0;            // ‖v(0)‖_∞
  double least_increase = 0;   // the smallest entry of an increment of v: >= 0 where v is nondecreasing
  double least_w = 0;          // the smallest entry of q + M v
  double complementarity = 0;  // max_i |∫ w_i dv_i|
};

// Errors of all: InvalidArgument, "field: description".

// Measures `v`, any piecewise linear path with n entries over the same time as q, against `problem`.
// Errors: InvalidArgument for shapes, times and non-finite entries. Cost: O(n²) for each node of q or v.
absl::StatusOr<DcpCertificate> CheckDcpSolution(const DcpProblem& problem, const PiecewiseLinearPath& v);

struct DcpSolution {
  bool solved = false;  // v reaches the end of q
  std::string message;  // why not, and when
  PiecewiseLinearPath v;
  DcpCertificate certificate;  // of v between its nodes too
  Fact unique;                 // TestDcpUniqueness(M)
};

// Solves by time stepping: at each node, v_j = v_{j-1} + z with z from LCP(q_j + M v_{j-1}, M), for strictly
// semicopositive M solvable whatever q is. Nodes: those of q, and between them steps of at most `max_step`.
//
// At the nodes w >= 0 and z ⟂ w_j hold, so for a q of jumps alone the answer is exact. Where q is linear, so
// is v between nodes, and ∫ w_i dv_i is half of w_{j-1,i} z_i on a step: first order in the step, and zero
// where the active set does not change. Any solution is taken where LCPs have several; `unique` says whether
// others must be expected. Errors: InvalidArgument for shapes, times, non-finite entries, q(0) not >= 0, or
// max_step <= 0; Cancelled if `stop` is requested, which is checked at every step.
absl::StatusOr<DcpSolution> SolveDcp(const DcpProblem& problem, double max_step, std::stop_token stop = {});

// Whether DCP(q, M) has one solution for every q in D^n with q(0) >= 0.
//
// No where M is no P-matrix (necessary, as Mandelbaum noted; the witness is that of TestPMatrix). Yes for
// symmetric positive definite M, where ∫ (Mv)ᵀdv >= vᵀMv/2, and for H-matrices with positive diagonal: after
// scaling, M = I - Q with spectral radius of |Q| below 1, and v is the fixed point of a contraction (Harrison
// & Reiman 1981; Dupuis & Ishii 1991). Unknown otherwise: there are P-matrices of both kinds (Example 10).
Fact TestDcpUniqueness(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DYNAMIC_LCP_H_
