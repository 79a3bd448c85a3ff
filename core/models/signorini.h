// SPDX-License-Identifier: Apache-2.0
// A membrane on the side of a square or a cube: the parabolic Signorini problem.

#ifndef DLCS_CORE_MODELS_SIGNORINI_H_
#define DLCS_CORE_MODELS_SIGNORINI_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/problem/problem.h"

namespace dlcs {

// (4.3), (4.4) of [Wu & Chen], core/analysis/PAPERS.md, on the unit square with the membrane on x1 = 0:
//     V_t = c ΔV inside,   0 <= ∂V/∂ν ⟂ V - ψ(x2, t) >= 0 on the membrane,   V = 0 on the other sides,
//     V(x, 0) = 20 x1 x2 (1 - x1)(1 - x2).
// The initial value and ψ are hardly legible in print; the defaults of ψ are our reading of (4.7). In three dimensions,
// on the unit cube, V(x, 0) = 100 x1 x2 x3 (1 - x1)(1 - x2)(1 - x3).
struct SignoriniModel {
  Index cells = 16;           // 1/Δx >= 2
  Index dimensions = 2;       // 2 or 3
  double coefficient = 2e-4;  // c > 0
  double horizon = 4;         // T
  // ψ as formulas in t: where |x2 - 1/2| <= 1/4 (and |x3 - 1/2| <= 1/4), and elsewhere.
  std::string psi_middle = "sin(4*pi*t)", psi_sides = "sin(2*pi*t)";
};

// The system (4.5), (4.6), appendix A: centered differences at the Q² inner points of the grid, Q = cells - 1,
// the ghost points eliminated. x_{qQ + p} = V((p+1)Δx, (q+1)Δx), y = V(0, ·) - ψ, and with D = tridiag(1, -2,
// 1)
//     A = c/Δx² (I⊗D + D⊗I),   B = c/Δx² (I⊗e_1),   f = B ψ,
//     N = -2 (I⊗e_1ᵀ),         M = 2I - D,          g = M ψ.
// M is a symmetric M-matrix, A symmetric negative definite; w = 2Δx ∂V/∂ν + O(Δx³) where V is steady.
// In three dimensions x_{(rQ + q)Q + p} = V((p+1)Δx, (q+1)Δx, (r+1)Δx), and M = 2I - I⊗D - D⊗I.
// A is a Kronecker sum, B, N and M are sparse, f and g are lifts of the functions ψ. Errors: InvalidArgument, one
// line per broken rule.
absl::StatusOr<Problem> MakeSignoriniProblem(const SignoriniModel& model);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_SIGNORINI_H_
