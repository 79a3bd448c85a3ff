// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/resource_names.h"

#include <string_view>

#include "fmt/format.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

constexpr std::string_view kJobPrefix = "jobs/";
constexpr std::string_view kProblemPrefix = "problems/";

}  // namespace

std::string JobName(const jobs::JobId& id) { return std::string(kJobPrefix) + id; }

absl::StatusOr<jobs::JobId> JobIdOf(const std::string& name) {
  if (name.starts_with(kJobPrefix) && jobs::IsJobId(name.substr(kJobPrefix.size())))
    return name.substr(kJobPrefix.size());
  return InvalidRequest({{"name", fmt::format("{}; must be jobs/ and 26 characters of a-z2-7", Quoted(name))}});
}

std::string ProblemName(const jobs::ProblemId& id) { return std::string(kProblemPrefix) + id; }

absl::StatusOr<jobs::ProblemId> ProblemIdOf(const std::string& name, const char* field) {
  if (name.starts_with(kProblemPrefix) && jobs::IsProblemId(name.substr(kProblemPrefix.size())))
    return name.substr(kProblemPrefix.size());
  return InvalidRequest({{field, fmt::format("{}; must be problems/ and 64 characters of 0-9a-f", Quoted(name))}});
}

}  // namespace dlcs
