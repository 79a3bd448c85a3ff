// SPDX-License-Identifier: Apache-2.0
// Semicopositivity by a test of every principal submatrix.

#ifndef DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_SWEEP_H_
#define DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_SWEEP_H_

#include "core/matrix_classes/semicopositive.h"
#include "core/types.h"

namespace dlcs {

// The sweep of ClassifySemicopositive(), for n <= 20.
SemicopositiveClasses SweepSemicopositive(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_SWEEP_H_
