// SPDX-License-Identifier: Apache-2.0
#include "server/store/refusal.h"

#include <sstream>

#include "absl/strings/cord.h"
#include "fmt/format.h"

namespace dlcs::jobs {
namespace {

// Used within this process only: WithDetails() turns a Refusal into google.rpc details for the wire.
constexpr char kPayload[] = "dlcs.jobs/Refusal";

}  // namespace

absl::Status ToStatus(const Refusal& refusal) {
  std::string text =
      fmt::format("{} is {:.6g}, and this needs {:.6g}.", refusal.limit, refusal.value, refusal.requested);
  double retry_seconds = -1;
  if (refusal.retry_after.has_value()) {
    retry_seconds = std::chrono::duration<double>(*refusal.retry_after).count();
    text += fmt::format(" Try again in {:.3g} s.", retry_seconds);
  }
  absl::Status status = absl::ResourceExhaustedError(text);
  status.SetPayload(kPayload, absl::Cord(fmt::format("{} {:.17g} {:.17g} {:.17g}", refusal.limit, refusal.value,
                                                     refusal.requested, retry_seconds)));
  return status;
}

std::optional<Refusal> RefusalOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kPayload);
  if (!payload.has_value()) return std::nullopt;
  std::istringstream words{std::string(*payload)};
  Refusal refusal;
  double retry_seconds = -1;
  words >> refusal.limit >> refusal.value >> refusal.requested >> retry_seconds;
  if (retry_seconds >= 0) {
    refusal.retry_after = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(retry_seconds));
  }
  return refusal;
}

}  // namespace dlcs::jobs
