// SPDX-License-Identifier: Apache-2.0
// How y moves N x, in the Laplace domain.

#ifndef DLCS_CORE_LAPLACE_TRANSFER_FUNCTION_H_
#define DLCS_CORE_LAPLACE_TRANSFER_FUNCTION_H_

#include <complex>
#include <functional>

#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// H(z) = N (zI - A)⁻¹ B, n × n, and where it is singular. What the contours need of a system: one factorization of
// zI - A for each z, whatever the structure of A.
struct TransferFunction {
  // Safe to call from several threads at once. Not finite where z is an eigenvalue.
  std::function<Eigen::MatrixXcd(std::complex<double> z)> value;
  Eigen::VectorXcd eigenvalues;  // of A, or points whose convex hull with their conjugates holds them
};

// For dense A: one complex Schur form, some 100 m³, then O(m²n) for each z.
TransferFunction DenseTransferFunction(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_TRANSFER_FUNCTION_H_
