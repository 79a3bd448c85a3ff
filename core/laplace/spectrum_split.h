// SPDX-License-Identifier: Apache-2.0
// A matrix in two invariant subspaces: one whose eigenvalues a contour encloses, and the rest.

#ifndef DLCS_CORE_LAPLACE_SPECTRUM_SPLIT_H_
#define DLCS_CORE_LAPLACE_SPECTRUM_SPLIT_H_

#include <complex>
#include <functional>

#include "core/laplace/resolvent.h"
#include "core/types.h"

namespace dlcs {

// e^{tA} = (its part by the resolvent of `inside`) + basis e^{t outside} left. The second part holds the eigenvalues
// that no hyperbola (2.2) encloses for all t. Remark 2.1 of [Wu & Chen] adds circles around them, but counts e^{λt}
// twice while t is so small that the hyperbola encloses λ too; here every eigenvalue is in one part for all t.
struct SpectrumSplit {
  Resolvent inside;
  Matrix basis;          // m × k, orthonormal columns that span the invariant subspace of the k eigenvalues outside
  Matrix outside;        // k × k, A on that subspace
  Matrix left;           // k × m, left · basis = I, left · A = outside · left
  double condition = 1;  // of the two subspaces: the norm of the projector, 1 where they are orthogonal

  Index separated() const { return outside.rows(); }
};

// Splits a real A by `is_outside`, which must treat conjugates alike. By a complex Schur form with the eigenvalues
// outside ordered first, and a Sylvester equation for the angle between the subspaces. Where an eigenvalue outside
// is so close to one inside that the projector's norm exceeds kWorstCondition, or splits a conjugate pair, all of A
// counts as outside.
// Cost: the Schur form, some 100 m³, and O(m³).
// Source: Golub and Van Loan, Matrix Computations, sections 7.6.2 and 7.6.3.
SpectrumSplit SplitSpectrum(const Matrix& A, const std::function<bool(std::complex<double> lambda)>& is_outside);
inline constexpr double kWorstCondition = 1e4;

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_SPECTRUM_SPLIT_H_
