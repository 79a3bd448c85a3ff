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
// ‖Z/2^s‖_1 <= 1/2 (Paterson-Stockmeyer, degree 15, truncation 1e-19), then s doublings.
//
// Non-finite entries of Z, or an overflow of e^Z, give non-finite matrices, not an error.
// Accuracy: some 1e-15 relative to ‖φ_k‖ when Z is not far from normal (shown in phi_functions_test.cc).
// Cost:     6 + 3s products of m × m matrices, between and in which it looks for a stop (core/parallel/stop_scope.h).
// Source:   [Higham 2008] N. J. Higham. Functions of Matrices. SIAM. Sections 4.2 and 10.7.4.
PhiFunctions ComputePhiFunctions(const Matrix& Z);

// φ_k(2Z) from φ_k(Z):  φ_0(2z) = φ_0²,  φ_1(2z) = (φ_0 + 1) φ_1 / 2,  φ_2(2z) = (φ_1² + 2 φ_2) / 4.
PhiFunctions DoublePhiFunctions(const PhiFunctions& phi);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PHI_FUNCTIONS_H_
