// SPDX-License-Identifier: Apache-2.0
// Linear functions of sources and their derivatives, as functions of time.

#ifndef DLCS_CORE_CIRCUITS_SOURCE_TERMS_H_
#define DLCS_CORE_CIRCUITS_SOURCE_TERMS_H_

#include <vector>

#include "core/circuits/circuit_branches.h"
#include "core/problem/time_function.h"
#include "core/types.h"

namespace dlcs {

// of_s s(t) + of_ds s'(t) as a matrix times functions of time: 1, and the waveforms and derivatives that occur and are
// not constant.
TimeFunction FunctionOfSources(const std::vector<SourceBranch>& sources, const Matrix& of_s, const Matrix& of_ds,
                               double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_SOURCE_TERMS_H_
