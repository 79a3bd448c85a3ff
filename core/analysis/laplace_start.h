// SPDX-License-Identifier: Apache-2.0
// How long the LCPs of the iteration stay solvable when it starts from the constant x0: Theorem 3.2 of [Wu & Chen].

#ifndef DLCS_CORE_ANALYSIS_LAPLACE_START_H_
#define DLCS_CORE_ANALYSIS_LAPLACE_START_H_

#include <optional>
#include <string>

#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"

namespace dlcs {

// Whether (3.6) holds:  max_{k>0} [ C_0 Σ_{r<k} a^r/r! + β a^k/k! ] < β  with a = T L̃ Θ_max.
bool SatisfiesThreeSix(double first_move, double a, double beta);

// Theorem 3.2 for growing T, on 256 steps of [0, T] and the nodes of the break points.
//
// C_0 is meant to bound ‖x^1 - x0‖. The printed formula has ‖e^{At}‖‖x0‖ in place of ‖(e^{At} - I) x0‖. That is at
// least ‖x0‖ even for short T, and it is no bound where e^{At} x0 turns against x0. Here C_0 is sup ‖x^1(t) - x0‖
// itself.
//
// The last term of (3.6) is the distance ‖x^0 - x0‖ of the start, which the theorem sets to 0: C_0 e^a < β is enough.
struct GuaranteedStart {
  std::optional<double> radius;  // ρ: FEA(q, M) is not empty for ‖q - (N x0 + g(0))‖_∞ <= ρ; may be infinite
  double beta = 0;               // β of (3.5) at T* (printed form)
  double first_move = 0;         // C_0 at T*
  double t_star = 0;             // T*: the last node at which (3.6) holds from 0 on; at most `horizon`
  double t_star_from_x0 = 0;     // the same for C_0 e^a < β
  std::string failure;  // why nothing is known (no LCP at 0, a source that is not finite); then all numbers are 0
};

// `rate` is L̃ Θ_max. Only the first iterate is computed, by one propagation of y^1 = SOL(N x0 + g(t), M). The maxima
// are taken over nodes, so the result is an estimate. Cost: one set of φ-functions for each step length, 257 LCPs, two
// linear programs.
GuaranteedStart MeasureGuaranteedStart(const Problem& problem, Selection selection, double rate);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_LAPLACE_START_H_
