// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/job_refusal.h"

#include <chrono>
#include <optional>
#include <string>

#include "fmt/format.h"
#include "server/store/refusal.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

// The message for users; programs read the details of the status.
std::string InWords(const jobs::Refusal& refusal) {
  if (refusal.limit == "deadline") {
    return fmt::format("The predicted time until the job ends is {:.3g} s, but the deadline leaves {:.3g} s.",
                       refusal.requested, refusal.value);
  }
  if (refusal.limit.starts_with("max_uploaded")) {
    return fmt::format(
        "With this problem {} would be {:.10g}, and this server allows {:.10g}. Delete problems that are not "
        "needed any more.",
        refusal.limit, refusal.requested, refusal.value);
  }
  if (refusal.retry_after) {
    return fmt::format("The queue is full: with this job {} would be {:.10g}, and this server allows {:.10g}.",
                       refusal.limit, refusal.requested, refusal.value);
  }
  return fmt::format(
      "The job is predicted to need {} = {:.10g}, and this server allows {:.10g}. Ask for less, or run a "
      "server with a higher limit.",
      refusal.limit, refusal.requested, refusal.value);
}

}  // namespace

absl::Status WithDetails(const absl::Status& status) {
  const std::optional<jobs::Refusal> refusal = jobs::RefusalOf(status);
  if (!refusal) return status;
  if (refusal->limit == "deadline" && refusal->value <= 0) {
    return InvalidRequest({{"deadline", fmt::format("passed {:.3g} s ago; must be in the future", -refusal->value)}});
  }
  std::optional<std::chrono::milliseconds> retry_after;
  if (refusal->retry_after) {
    retry_after = std::chrono::duration_cast<std::chrono::milliseconds>(*refusal->retry_after);
  }
  return Refused(InWords(*refusal), {refusal->limit, refusal->value, refusal->requested}, retry_after);
}

}  // namespace dlcs
