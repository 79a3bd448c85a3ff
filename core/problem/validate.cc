// SPDX-License-Identifier: Apache-2.0
#include "core/problem/validate.h"

#include <string>
#include <utility>
#include <vector>

namespace dlcs {

absl::Status StatusOf(const std::vector<Violation>& violations) {
  if (violations.empty()) return absl::OkStatus();
  std::string text;
  for (const Violation& violation : violations) {
    if (!text.empty()) text += '\n';
    text += violation.field + ": " + violation.description;
  }
  return absl::InvalidArgumentError(text);
}

absl::Status CheckValid(const Problem& problem, const Options& options) {
  std::vector<Violation> violations = Validate(problem);
  for (Violation& violation : Validate(options, problem.horizon)) violations.push_back(std::move(violation));
  return StatusOf(violations);
}

}  // namespace dlcs
