// SPDX-License-Identifier: Apache-2.0
#include "core/problem/validate.h"

#include <utility>
#include <vector>

#include "core/problem/condition_pairs.h"
#include "core/problem/number_range.h"
#include "core/problem/source_periods.h"
#include "core/problem/violation_list.h"

namespace dlcs {

std::vector<Violation> Validate(const Problem& problem, const Options& options) {
  std::vector<Violation> violations = Validate(problem);
  if (violations.empty()) {
    ViolationList of_range;
    if (problem.switching.is_empty()) {
      CheckNumberRange(problem, of_range);
    } else {
      CheckNumberRange(WithConditionPairs(problem), of_range);
    }
    violations = std::move(of_range).Take();
  }
  for (Violation& violation : Validate(options, problem.horizon)) violations.push_back(std::move(violation));
  if (violations.empty()) violations = CheckPeriod(problem, options);
  return violations;
}

absl::Status CheckValid(const Problem& problem, const Options& options) {
  return StatusOf(Validate(problem, options));
}

}  // namespace dlcs
