// SPDX-License-Identifier: Apache-2.0
// Linear functions of sources and their derivatives, as functions of time.

#ifndef DLCS_CORE_CIRCUITS_SOURCE_TERMS_H_
#define DLCS_CORE_CIRCUITS_SOURCE_TERMS_H_

#include <vector>

#include "core/problem/time_function.h"
#include "core/types.h"

namespace dlcs {

struct SourceBranch;

// of_s s(t) + of_ds s'(t) as a matrix times functions of time: 1, and the waveforms and derivatives that occur and are
// not constant.
TimeFunction FunctionOfSources(const std::vector<SourceBranch>& sources, const Matrix& of_s, const Matrix& of_ds,
                               double horizon);

// rows · function(t) + constants, for a `function` as FunctionOfSources() makes it. Functions of time that the result
// does not need are left out, since each is searched for switching times.
TimeFunction RowsOf(const TimeFunction& function, const Matrix& rows, const Vector& constants);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_SOURCE_TERMS_H_
