// SPDX-License-Identifier: Apache-2.0
// Block principal pivoting for P-matrices.

#ifndef DLCS_CORE_LCP_PRINCIPAL_PIVOTING_H_
#define DLCS_CORE_LCP_PRINCIPAL_PIVOTING_H_

#include "core/lcp/basis_point.h"

namespace dlcs {

// Moves from `basis` to a basis whose point solves `lcp`: all infeasible indices change sides at once (a
// semismooth Newton step); when their number has not dropped for a few rounds, only the least of them does
// until it drops (Murty's rule). On a P-matrix that is finite from any start, in exact arithmetic.
//
// True when `point` is solved. False when a basis on the way is singular, or after `max_rounds` rounds:
// neither says anything about solutions. Adds the exchanges to `pivots`. One factorization per round.
//
// Source: [Júdice & Pires 1994] J. J. Júdice, F. M. Pires. A block principal pivoting algorithm for
// large-scale
//         strictly monotone linear complementarity problems. Computers & Operations Research 21, 587-596.
bool PivotPrincipally(const ScaledLcp& lcp, int max_rounds, BasisPoint& point, Basis& basis, Index& pivots);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_PRINCIPAL_PIVOTING_H_
