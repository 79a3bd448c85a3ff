// SPDX-License-Identifier: Apache-2.0
// The zeros of an inverse that follow from those of the matrix.

#ifndef DLCS_CORE_LINALG_STRUCTURAL_ZEROS_H_
#define DLCS_CORE_LINALG_STRUCTURAL_ZEROS_H_

#include "core/types.h"

namespace dlcs {

// Sets the entries of `inverse`, which is matrix⁻¹ but for rounding, to zero that are zero for all values of the
// nonzero entries of `matrix`: where an unknown does not depend on a right-hand side. Rounding of 1e-16 there, times a
// large right-hand side, has a sign of its own, which no bound of its size tells from a result. `matrix` is n × n and
// nonsingular; if it has no n nonzero entries in different rows and columns, nothing is done.
//
// Rows are matched with the unknowns that they determine, and then the strongly connected components tell which depends
// on which (the fine decomposition of Dulmage and Mendelsohn). Cost: the entries; in the worst case n times that.
void ClearStructuralZeros(const Eigen::Ref<const Matrix>& matrix, Matrix& inverse);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_STRUCTURAL_ZEROS_H_
