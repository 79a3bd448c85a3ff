// SPDX-License-Identifier: Apache-2.0
// The mass matrix E of E x' = A x + B y + f, as finite elements bring one.

#ifndef DLCS_CORE_PROBLEM_MASS_MATRIX_H_
#define DLCS_CORE_PROBLEM_MASS_MATRIX_H_

#include <string>

#include "core/linalg/structured_matrix.h"
#include "core/problem/problem.h"

namespace dlcs {

// Why the square, finite E has no inverse to working precision: rows or columns of zeros, or the rows or columns that
// depend on each other. Empty where it has one. Rows and columns are scaled first, so that units do not matter. Cost:
// one factorization, sparse unless E is dense; where that is predicted to take minutes only zeros are looked for.
std::string WhySingular(const StructuredMatrix& E);

// Whether no entry off the diagonal of E is other than zero.
bool IsDiagonal(const StructuredMatrix& E);

// E⁻¹ times the columns; the columns themselves if `problem` has no mass matrix. E must be nonsingular. Cost: one
// factorization of E, and a solve for each column.
Matrix SolveMass(const Problem& problem, const Matrix& columns);

// The system x' = E⁻¹A x + E⁻¹B y + E⁻¹f with the same x, y and w. E must be nonsingular. A diagonal E leaves sparse
// matrices sparse; otherwise E⁻¹A and E⁻¹B are dense, of which the first takes m solves.
Problem WithoutMass(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_MASS_MATRIX_H_
