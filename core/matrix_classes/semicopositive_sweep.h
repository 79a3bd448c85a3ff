// SPDX-License-Identifier: Apache-2.0
// Semicopositivity by a test of every principal submatrix.

#ifndef DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_SWEEP_H_
#define DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_SWEEP_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

struct SemicopositiveClasses {
  Fact strict;  // z >= 0 and z ∘ Mz <= 0 imply z = 0: (1) of [Shen & Pang 2007]; completely S, of type 0
  Fact weak;    // no z >= 0, z != 0, has (Mz)_i < 0 wherever z_i > 0: semimonotone, E0
};

// The sweep of ClassifySemicopositive(), for n <= 20.
SemicopositiveClasses SweepSemicopositive(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_SWEEP_H_
