// SPDX-License-Identifier: Apache-2.0
// Scaling of a matrix by powers of two to entries of size one.

#ifndef DLCS_CORE_LINALG_EQUILIBRATION_H_
#define DLCS_CORE_LINALG_EQUILIBRATION_H_

#include "core/types.h"

namespace dlcs {

// Positive d, powers of two, such that the largest entry in row or column i of D M D is of size one for
// every i whose row or column is not zero (d_i = 1 for the others).
//
// LCP(q, M) in y becomes LCP(D q, D M D) in y' = D⁻¹ y with w' = D w: signs, complementarity, solutions and every
// matrix class of ours are kept, and since the factors are powers of two nothing is rounded. After scaling one relative
// tolerance fits all entries (circuits have entries of size 1e-6 and 1e6).
//
// E M E has the same scaled matrix as M, bit for bit, for every E of powers of two: the exponents of M are first
// brought into a form that does not depend on E.
//
// Source: [Ruiz 2001] D. Ruiz. A scaling algorithm to equilibrate both rows and columns norms in matrices.
//         Rutherford Appleton Laboratory, RAL-TR-2001-034. Here rows and columns share one factor.
Vector SymmetricEquilibration(const Matrix& M);

// The same with a factor for each row and one for each column: the largest entry in every row and column of R M C that
// is not zero is of size one. LCP(q, M) becomes LCP(R q, R M C) in y' = C⁻¹ y with w' = R w. Signs, complementarity,
// solutions and the classes that are defined by signs are kept (P, Z, M, S, Q, semicopositive), but not those of the
// quadratic form. E M F has the same scaled matrix as M for all E, F of powers of two. Only the product of the two
// factors of an entry is determined: factors of rows and columns are about equal where M is symmetric.
struct Equilibration {
  Vector row, column;
};
Equilibration EquilibrateRowsAndColumns(const Matrix& M);

// The largest power of two that is not above `size`; one for zero and for what is not finite.
double PowerOfTwo(double size);

// R M C.
Matrix Scaled(const Matrix& M, const Equilibration& scale);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_EQUILIBRATION_H_
