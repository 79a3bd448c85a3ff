// SPDX-License-Identifier: Apache-2.0
#include "core/problem/validate.h"

#include <utility>
#include <vector>

#include "core/problem/source_periods.h"
#include "core/problem/violation_list.h"

namespace dlcs {

absl::Status CheckValid(const Problem& problem, const Options& options) {
  std::vector<Violation> violations = Validate(problem);
  for (Violation& violation : Validate(options, problem.horizon)) violations.push_back(std::move(violation));
  if (violations.empty()) violations = CheckPeriod(problem, options);
  return StatusOf(violations);
}

}  // namespace dlcs
