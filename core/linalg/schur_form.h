// SPDX-License-Identifier: Apache-2.0
// The complex Schur form of a real matrix, by a computation that can be stopped.

#ifndef DLCS_CORE_LINALG_SCHUR_FORM_H_
#define DLCS_CORE_LINALG_SCHUR_FORM_H_

#include <optional>

#include "core/types.h"

namespace dlcs {

// A = vectors · triangle · vectorsᴴ, `vectors` unitary, `triangle` upper triangular.
struct SchurForm {
  Eigen::MatrixXcd triangle;
  Eigen::MatrixXcd vectors;
};

// By Householder's reduction to Hessenberg form and the QR algorithm with single shifts [Golub & Van Loan 2013,
// 7.4-7.5], as Eigen::ComplexSchur, which may run for hours on a large matrix and cannot be stopped. Checks for a stop
// (core/parallel/stop_scope.h) before every reflection and rotation. Absent where the iteration does not converge, as
// for entries that are not finite. Cost: some 100 m³.
// Source: [Golub & Van Loan 2013] G. H. Golub, C. F. Van Loan. Matrix Computations. Johns Hopkins University Press.
std::optional<SchurForm> ComputeSchurForm(const Matrix& A);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SCHUR_FORM_H_
