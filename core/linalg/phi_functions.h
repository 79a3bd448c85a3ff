// SPDX-License-Identifier: Apache-2.0
// The functions φ_0, φ_1, φ_2 of a matrix, from which one exponential step is made.

#ifndef DLCS_CORE_LINALG_PHI_FUNCTIONS_H_
#define DLCS_CORE_LINALG_PHI_FUNCTIONS_H_

#include "core/types.h"

namespace dlcs {

// φ_0(z) = e^z,  φ_1(z) = (e^z - 1)/z,  φ_2(z) = (φ_1(z) - 1)/z  at a square matrix Z.
struct PhiFunctions {
  Matrix phi0;
  Matrix phi1;
  Matrix phi2;
};

// Computes φ_0, φ_1, φ_2 at `Z` (square) by scaling and squaring: the Taylor polynomial of φ_2 at Z/2^s with
// ‖Z/2^s‖_1 <= 1/2 in balanced units (core/linalg/balance.h; Paterson-Stockmeyer, degree 15, truncation 1e-19), then s
// doublings, in which e^Z - I takes the place of e^Z where that is near the identity.
//
// Non-finite entries of Z, or an overflow of e^Z, give non-finite matrices, not an error.
// Accuracy: some 1e-15 relative to ‖φ_k‖ when Z is not far from normal, entry by entry in any units of the states. Slow
//           states keep their digits beside fast ones: the error is s times what one ulp of the entries of Z makes,
//           where they are coupled, and some ulps of e^Z where they are not (shown in phi_functions_test.cc).
// Cost: 6 + 3s products of m × m matrices, between and in which it checks for a stop (core/parallel/stop_scope.h).
// Source:   [Higham 2008] N. J. Higham. Functions of Matrices. SIAM. Sections 4.2 and 10.7.4.
PhiFunctions ComputePhiFunctions(const Matrix& Z);

// Both at Z/2 and at Z, for the middle and the end of a step: at the cost of the latter.
struct PhiFunctionsOfStep {
  PhiFunctions half;
  PhiFunctions whole;
};
PhiFunctionsOfStep ComputePhiFunctionsOfStep(const Matrix& Z);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PHI_FUNCTIONS_H_
