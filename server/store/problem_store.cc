// SPDX-License-Identifier: Apache-2.0
#include "server/store/problem_store.h"

#include "fmt/format.h"
#include "server/store/refusal.h"

namespace dlcs::jobs {

bool IsProblemId(std::string_view text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

absl::Status NoSuchProblem(const ProblemId& id) {
  // The requested name may be any text: only valid names are repeated in the message.
  return absl::NotFoundError(IsProblemId(id) ? fmt::format("There is no uploaded problem {}. Upload it (again).", id)
                                             : "There is no uploaded problem of that name.");
}

absl::Status ProblemIsHeld() {
  return absl::FailedPreconditionError("A job that has not ended needs the problem: wait for its end or cancel it.");
}

absl::Status CheckProblemId(const ProblemId& id) {
  if (IsProblemId(id)) return absl::OkStatus();
  return absl::InvalidArgumentError("A problem's id is the SHA-256 of its body.");
}

absl::Status CheckQuota(const ProblemQuota& quota, std::int64_t problems, std::int64_t held, std::int64_t bytes) {
  if (problems >= quota.max_problems) {
    return ToStatus({.limit = "max_uploaded_problems_per_user",
                     .value = static_cast<double>(quota.max_problems),
                     .requested = static_cast<double>(problems + 1),
                     .retry_after = std::nullopt});
  }
  if (held + bytes > quota.max_bytes) {
    return ToStatus({.limit = "max_uploaded_bytes_per_user",
                     .value = static_cast<double>(quota.max_bytes),
                     .requested = static_cast<double>(held + bytes),
                     .retry_after = std::nullopt});
  }
  return absl::OkStatus();
}

}  // namespace dlcs::jobs
