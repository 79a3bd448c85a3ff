// SPDX-License-Identifier: Apache-2.0
// Validation of problem and options together, called by the entry points of the engine.

#ifndef DLCS_CORE_PROBLEM_VALIDATE_H_
#define DLCS_CORE_PROBLEM_VALIDATE_H_

#include <vector>

#include "absl/status/status.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

// OK, or InvalidArgument with every violation of problem and options in the message ("field: description", one per
// line; Validate() gives them singly).
absl::Status CheckValid(const Problem& problem, const Options& options);

// OK where there are no `violations`; otherwise InvalidArgument with all of them.
absl::Status StatusOf(const std::vector<Violation>& violations);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_VALIDATE_H_
