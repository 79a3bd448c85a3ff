// SPDX-License-Identifier: Apache-2.0
// A Schur form that keeps the relative accuracy of small eigenvalues next to large ones.

#ifndef DLCS_CORE_LINALG_GRADED_SCHUR_H_
#define DLCS_CORE_LINALG_GRADED_SCHUR_H_

#include <optional>

#include "core/types.h"

namespace dlcs {

// A = vectors · triangle · inverse and inverse · vectors = I, `triangle` upper triangular. vectors = P D U: a
// permutation, powers of two, and a unitary matrix for each irreducible block of A (core/linalg/balance.h).
struct GradedSchurForm {
  Eigen::MatrixXcd triangle;
  Eigen::MatrixXcd vectors;
  Eigen::MatrixXcd inverse;  // of `vectors`
};

// For z = inverse · x, x' = A x + b is z' = triangle · z + inverse · b, to be solved from the last row up. A diagonal
// or triangular A is its own form, reordered and scaled without rounding. Where a block is graded, that is, where some
// of its parts are coupled by entries far smaller than the largest, and where `duration` · ‖block‖ makes the rounding
// of the QR algorithm matter, its Schur form is made in double-double arithmetic, with the fast eigenvalues first, and
// then rounded: the slow eigenvalues keep their digits as far as the entries of A determine them. A block without such
// parts is rounded as by ComputeSchurForm(): changes of one ulp of its entries move slow eigenvalues as much.
//
// `duration`: the time over which the form serves; infinity if unknown. Absent where QR does not converge, or an entry
// is not finite. Checks for a stop. Cost: of an irreducible block of size k some 100 k³; with double-double, up to size
// 64, 20 times as much.
std::optional<GradedSchurForm> ComputeGradedSchurForm(const Matrix& A, double duration);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_GRADED_SCHUR_H_
