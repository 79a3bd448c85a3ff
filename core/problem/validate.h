// SPDX-License-Identifier: Apache-2.0
// Validation of problem and options together, called by the entry points of the engine.

#ifndef DLCS_CORE_PROBLEM_VALIDATE_H_
#define DLCS_CORE_PROBLEM_VALIDATE_H_

#include <vector>

#include "absl/status/status.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/violation_list.h"

namespace dlcs {

// Every rule that problem and options break, each by itself and together. If the problem breaks none, also what its
// products overflow (number_range.h).
std::vector<Violation> Validate(const Problem& problem, const Options& options);

// OK, or InvalidArgument that carries all of them (StatusOf() in violation_list.h).
absl::Status CheckValid(const Problem& problem, const Options& options);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_VALIDATE_H_
