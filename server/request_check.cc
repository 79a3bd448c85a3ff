// SPDX-License-Identifier: Apache-2.0
#include "server/request_check.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "server/convert.h"
#include "server/errors.h"

namespace dlcs {
namespace {

// What the engine will find wrong when it is asked to run, named as on the wire.
template <typename System>
std::vector<Violation> AllViolations(const System& problem, const Options& options) {
  std::vector<Violation> violations = Validate(problem);
  for (Violation& violation : Validate(options, problem.horizon)) {
    violations.push_back({WireOptionName(violation.field), std::move(violation.description)});
  }
  return violations;
}

template <typename System>
absl::StatusOr<SoundSystem> Checked(System problem, const v1::SolveOptions& wire_options,
                                    std::vector<Violation> violations, const SessionLimits& limits) {
  Options options = OptionsFromProto(wire_options, violations);
  if (!violations.empty()) return InvalidRequest(violations);

  absl::Status limit = CheckLimit("max_states", static_cast<double>(problem.num_states()), limits.max_states);
  limit.Update(
      CheckLimit("max_constraints", static_cast<double>(problem.num_constraints()), limits.max_constraints));
  if (!limit.ok()) return limit;

  violations = AllViolations(problem, options);
  if (!violations.empty()) return InvalidRequest(violations);
  return SoundSystem{std::move(problem), std::move(options)};
}

}  // namespace

absl::Status CheckLimit(const char* name, double asked, std::int64_t limit) {
  if (asked <= static_cast<double>(limit)) return absl::OkStatus();
  return LimitExceeded(name, limit, static_cast<std::int64_t>(std::min(asked, 9e18)));
}

absl::StatusOr<SoundSystem> ReadSound(const v1::Problem& problem, const v1::SolveOptions& options,
                                      const SessionLimits& limits) {
  std::vector<Violation> violations;
  Problem read = ProblemFromProto(problem, violations);
  return Checked(std::move(read), options, std::move(violations), limits);
}

absl::StatusOr<SoundSystem> ReadSound(const v1::NonlinearProblem& problem, const v1::SolveOptions& options,
                                      const SessionLimits& limits) {
  std::vector<Violation> violations;
  NonlinearProblem read = NonlinearProblemFromProto(problem, violations);
  return Checked(std::move(read), options, std::move(violations), limits);
}

absl::Status FromEngine(const absl::Status& status) {
  if (status.code() != absl::StatusCode::kInvalidArgument) return status;
  std::vector<Violation> violations;
  std::istringstream lines{std::string(status.message())};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = std::min(line.find(": "), line.size());
    violations.push_back({WireOptionName(line.substr(0, colon)),
                          colon < line.size() ? line.substr(colon + 2) : std::string()});
  }
  return InvalidRequest(violations);
}

}  // namespace dlcs
