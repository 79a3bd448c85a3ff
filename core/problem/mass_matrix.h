// SPDX-License-Identifier: Apache-2.0
// The system E x' = A x + B y + f without its mass matrix E.

#ifndef DLCS_CORE_PROBLEM_MASS_MATRIX_H_
#define DLCS_CORE_PROBLEM_MASS_MATRIX_H_

#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// E⁻¹ times the columns; the columns themselves if `problem` has no mass matrix. E must be nonsingular. Cost: one
// factorization of E, and a solve for each column.
Matrix SolveMass(const Problem& problem, const Matrix& columns);

// The system x' = E⁻¹A x + E⁻¹B y + E⁻¹f with the same x, y and w. E must be nonsingular. A diagonal E leaves sparse
// matrices sparse; otherwise E⁻¹A and E⁻¹B are dense, of which the first takes m solves.
Problem WithoutMass(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_MASS_MATRIX_H_
