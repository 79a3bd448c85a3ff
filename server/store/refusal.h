// SPDX-License-Identifier: Apache-2.0
// Why a job was not taken: the limit, its value, and when to come back.

#ifndef DLCS_SERVER_STORE_REFUSAL_H_
#define DLCS_SERVER_STORE_REFUSAL_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "server/store/clock.h"

namespace dlcs::jobs {

struct Refusal {
  std::string limit;  // its name, as in SchedulerLimits; "deadline" for what comes too late
  double value = 0;   // of the limit
  double asked = 0;
  std::optional<Duration> retry_after;  // absent: never, on this server
};

// RESOURCE_EXHAUSTED with a text for people and the refusal itself inside.
absl::Status ToStatus(const Refusal& refusal);
// What ToStatus() put in; absent from other errors.
std::optional<Refusal> RefusalOf(const absl::Status& status);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_REFUSAL_H_
