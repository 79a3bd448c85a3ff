// SPDX-License-Identifier: Apache-2.0
// An inverse that is accurate where the matrix is not well conditioned.

#ifndef DLCS_CORE_LINALG_REFINED_INVERSE_H_
#define DLCS_CORE_LINALG_REFINED_INVERSE_H_

#include "core/types.h"

namespace dlcs {

// matrix⁻¹ to rounding of its largest entries, for a condition up to 1e12. An inverse from factors alone has the
// condition times that error, which large right-hand sides show: two diodes in parallel across 10 kΩ, of 20 mΩ each,
// then share a current of 22 A with a difference of 1 mA. So the residual I - matrix · inverse is computed in twice the
// digits and solved for, until it is rounding. A matrix whose condition is below 1,000 is not refined. Not finite where
// the matrix is singular. Checks for a stop. Cost: 2 n³ operations; some 20 n³ more for each of one to three steps.
// Source: [Higham 2002] N. J. Higham. Accuracy and Stability of Numerical Algorithms. SIAM. Section 12.1.
Matrix RefinedInverse(const Matrix& matrix);

// rows · matrix⁻¹, corrected by its residual likewise: the product alone has the rounding of large terms, of which
// little may be left. Zeros of the product stay zero.
Matrix RefinedQuotient(const Matrix& rows, const Matrix& matrix, const Matrix& inverse);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_REFINED_INVERSE_H_
