// SPDX-License-Identifier: Apache-2.0
// A triangular form of the linear differential-algebraic equation E x' = F x + b.

#ifndef DLCS_CORE_LINALG_PENCIL_FORM_H_
#define DLCS_CORE_LINALG_PENCIL_FORM_H_

#include <optional>

#include "core/types.h"

namespace dlcs {

// With x = vectors · c the equation is
//
//     slope_triangle c' = triangle c + left b,
//
// both triangles upper triangular, to be solved from the last row up. c = inverse · x.
struct PencilForm {
  Eigen::MatrixXcd slope_triangle;  // empty: the identity
  Eigen::MatrixXcd triangle;
  Eigen::MatrixXcd vectors;
  Eigen::MatrixXcd inverse;  // of `vectors`
  Eigen::MatrixXcd left;     // empty: `inverse`

  bool is_explicit() const { return slope_triangle.size() == 0; }
  // slope_triangle(i, j).
  std::complex<double> Slope(Index i, Index j) const {
    return is_explicit() ? std::complex<double>(i == j ? 1 : 0) : slope_triangle(i, j);
  }
};

// The form of x' = A x + b: ComputeGradedSchurForm() (core/linalg/graded_schur.h) for the same `duration`. Absent as
// there.
std::optional<PencilForm> ComputeExplicitForm(const Matrix& A, double duration);

// The form of E x' = F x + b, a pencil of index one at most. The last `num_algebraic` rows of E are zero. Rows may have
// any scale: a row of E that is small beside that of F is a fast one. Of the eigenvalues λ of the pencil the slow ones
// are accurate to rounding of F relative to its rows, whatever the others are; 1/λ has an absolute error of rounding
// times `duration`. That is so because what is brought into Schur form is G = (F - σE)⁻¹E, with a real shift σ of
// some few times 1/duration: the eigenvalues of G are 1/(λ - σ), and zero for the algebraic rows. The zeros are exact,
// since the columns of F's algebraic rows, transposed, span the left null space of G. Each block of states that depend
// on each other is brought into Schur form alone: among the fast states of a triangular A every 1/λ has its digits.
//
// `units`: positive powers of two, about the sizes of the states. Absent where the pencil is singular or an entry is
// not finite. Checks for a stop. Cost: some 100 m³.
std::optional<PencilForm> ComputePencilForm(const Matrix& E, const Matrix& F, Index num_algebraic, const Vector& units,
                                            double duration);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PENCIL_FORM_H_
