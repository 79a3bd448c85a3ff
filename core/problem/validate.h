// SPDX-License-Identifier: Apache-2.0
// Validation of problem and options together, called by the entry points of the engine.

#ifndef DLCS_CORE_PROBLEM_VALIDATE_H_
#define DLCS_CORE_PROBLEM_VALIDATE_H_

#include "absl/status/status.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

// OK, or InvalidArgument that carries every violation of problem and options (StatusOf() in violation_list.h).
absl::Status CheckValid(const Problem& problem, const Options& options);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_VALIDATE_H_
