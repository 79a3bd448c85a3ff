// SPDX-License-Identifier: Apache-2.0
// Finds a sector that contains the spectrum of a large sparse matrix.

#ifndef DLCS_CORE_PROPAGATOR_SECTOR_H_
#define DLCS_CORE_PROPAGATOR_SECTOR_H_

#include <functional>
#include <optional>
#include <string>

#include "core/linalg/structured_matrix.h"

namespace dlcs {

// |arg(σ - λ)| <= α: a wedge that opens to the left from σ.
struct Sector {
  double angle = 0;            // α, in [0, π/2)
  double shift = 0;            // σ >= 0
  double factor_nonzeros = 0;  // of the Cholesky factor of the proof
};

// A sector that holds the field of values { v*Av : ‖v‖₂ = 1 }, and so the spectrum, of A, with the contour of fewest
// nodes for times up to `horizon` (core/laplace/range_contour.h). It is proven by Cholesky factors: with S and K the
// symmetric and the skew part, the two half-planes whose intersection is the sector hold the field of values exactly if
//
//     σ I - S ± i cot(α) K     (one the conjugate of the other; σ I - S for symmetric A, where α = 0)
//
// are positive semidefinite [Johnson 1978, Numerical determination of the field of values. SIAM J. Numer. Anal. 15,
// 595-602]. Outside the sector ‖(zI - A)⁻¹‖₂ is at most 1 over the distance, even if A is far from normal.
//
// With a symmetric positive definite mass matrix E the field of values is that of the pencil, { v*Av : v*Ev = 1 }: E
// takes the place of I, and the resolvent is (zE - A)⁻¹ in the norm of E. `E` with 0 rows stands for the identity.
//
// Empty if E is no such matrix, or if there is no such sector with σ <= 3 / horizon and α <= 1.35: the solutions grow
// too much, or oscillate too fast for their decay.
// Cost: some ten factorizations.
std::optional<Sector> FindSector(const SparseMatrix& A, double horizon, const SparseMatrix& E = {});

// The same by another proof: `holds` tells whether a wedge holds the field of values. For a symmetric A its angle is 0
// in the result, whatever it was asked for.
std::optional<Sector> FindSector(const std::function<bool(double angle, double shift)>& holds, bool is_symmetric,
                                 double horizon);

// Why there is none.
std::string WhyNoSector(bool has_mass, double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_SECTOR_H_
