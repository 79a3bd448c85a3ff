// SPDX-License-Identifier: Apache-2.0
// The linear complementarity system x' = A x + B u, 0 <= u ⟂ C x >= 0 of index one: its bounds as numbers.

#ifndef DLCS_CORE_ANALYSIS_INDEX_ONE_H_
#define DLCS_CORE_ANALYSIS_INDEX_ONE_H_

#include <stop_token>

#include "core/analysis/semiobservability.h"
#include "core/matrix_classes/semicopositive_constant.h"
#include "core/types.h"

namespace dlcs {

// The triple (A, B, C) of [Shen & Pang 2007], where C is our N and M = 0. A m × m, B m × n, C n × m.
struct IndexOneSystem {
  Matrix A, B, C;
};

// Constants of Theorem 7 for the scheme (6)-(9), all in the ∞-norm. With σ of (3) for CB and h <= h̄:
//
//           max_i u_i (C(I - hA)⁻¹B u)_i >= σ/2 ‖u‖²,     since ‖C((I - hA)⁻¹ - I)B‖ <= ‖C‖‖A‖‖B‖ h/(1 - h‖A‖),
//     (10)  ‖u^{i+1}‖ <= ρ_u ‖x^i‖,                       wherever C x^i >= 0,
//     (11)  ‖x^{i+1} - x^i‖ <= h ψ_x ‖x^i‖.
//
// (10) takes the one index i that attains (3): 0 = u_i (C(I - hA)⁻¹x)_i + h u_i (C(I - hA)⁻¹Bu)_i. The
// printed proof sums over all i, which (3) does not bound; the constant 1 in (10) and (11) is not needed.
struct SteppingBounds {
  LowerBound sigma;  // of CB; where it is 0, so are the other fields
  double step = 0;   // h̄: every step in (0, h̄] has a solution; infinite for A = 0
  double rho_u = 0;
  double psi_x = 0;
};
SteppingBounds ComputeSteppingBounds(const IndexOneSystem& system);

// ‖ |C| (e^{|A|t} - I) |B| ‖_∞, the number that makes Lemma 8 true: Φ(t, u) = ∫_0^t C(e^{A(t-τ)} - I)Bu(τ) dτ
// of (12) has ‖Φ(t, u)‖ <= PhiBound(t) ‖∫_0^t u‖ for every u >= 0. Increasing in t; at most μt with μ =
// ‖C‖‖A‖‖B‖e^{‖A‖t}.
double PhiBound(const IndexOneSystem& system, double t);

// Constants of Theorem 9(a): for all x0 with Cx0 >= 0, every solution has, for t in [0, ε_1],
// ‖∫_0^t u‖ <= σ_2 ‖x0‖ and ‖x(t)‖ <= σ_1 ‖x0‖.
struct ShortTimeBounds {
  LowerBound sigma;     // of type I for CB; where it is 0, so are the other fields
  double epsilon1 = 0;  // the largest time in [0, T] with PhiBound <= σ/2, to one part in 500
  double sigma1 = 0;    // for the whole interval
  double sigma2 = 0;
};
// Cost: one set of φ-functions and at most 30 products of m × m matrices, in practice about ten. `stop` is checked
// before each product. After a stop ε_1 is smaller but still valid.
ShortTimeBounds ComputeShortTimeBounds(const IndexOneSystem& system, double horizon, std::stop_token stop = {});

// The time up to which C e^{At} x0 >= 0 is proven, at most `horizon`. It is 0 if x0 is not known to lie in the
// semiobservability cone.
//
// This is the ε of Theorem 9(b): when CB is of type I, u = 0 and x = e^{At}x0 is the only solution up to
// then. Proposition 6 asks f(t) = C e^{At}x0 >= 0, and its ε' does not depend on x0: so it can be applied
// again and again as long as f >= 0. The printed ε_2, the same for every x0, cannot exist: with A = [0 -1; 0
// 0], B = (1, 0)ᵀ, C = (1, 0) the state (δ, 1) is free until t = δ only.
//
// By Taylor at t = 0, |(C e^{At}A^k x0 - C A^k x0)_i| <= ‖C_i‖_1 (e^{‖A‖t} - 1) ‖A^k x0‖_∞, and again from each time
// reached; the steps shrink like a geometric series toward the true time, and at most 200 are taken. Cost: 19 products
// of A with a vector per step. `stop` is checked in every step; what was proven until then is returned.
double FreeMotionTime(const IndexOneSystem& system, const Vector& x0, const Semiobservability& start, double horizon,
                      std::stop_token stop = {});

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_INDEX_ONE_H_
