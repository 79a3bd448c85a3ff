// SPDX-License-Identifier: Apache-2.0
// Symmetric scaling of a matrix to entries of size one.

#ifndef DLCS_CORE_ANALYSIS_EQUILIBRATION_H_
#define DLCS_CORE_ANALYSIS_EQUILIBRATION_H_

#include "core/types.h"

namespace dlcs {

// Positive d, powers of two, such that the largest entry in row or column i of D M D is of size one for
// every i whose row or column is not zero (d_i = 1 for the others).
//
// LCP(q, M) in y becomes LCP(D q, D M D) in y' = D⁻¹ y with w' = D w: signs, complementarity, solutions and
// every matrix class of ours are kept, and since the factors are powers of two no bit is lost. What is won
// is that one relative tolerance fits all entries: circuits mix 1e-6 and 1e6.
//
// Source: [Ruiz 2001] D. Ruiz. A scaling algorithm to equilibrate both rows and columns norms in matrices.
//         Rutherford Appleton Laboratory, RAL-TR-2001-034. Here rows and columns share one factor.
Vector SymmetricEquilibration(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_EQUILIBRATION_H_
