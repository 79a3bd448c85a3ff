// SPDX-License-Identifier: Apache-2.0
// Predicts the memory of the matrices of one step for a large sparse A.

#ifndef DLCS_CORE_DRIVER_STEP_MEMORY_H_
#define DLCS_CORE_DRIVER_STEP_MEMORY_H_

#include "core/problem/problem.h"

namespace dlcs {

// The bytes of the matrices of a step by sparse factors with `factor_nonzeros` entries.
double SparseStepBytes(const Problem& problem, double factor_nonzeros);

// The bytes of an iterative step: I - hA beside a copy of A while it is made, the levels of multigrid, and vectors.
double IterativeStepBytes(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_STEP_MEMORY_H_
