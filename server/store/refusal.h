// SPDX-License-Identifier: Apache-2.0
// The refusal of a job: the limit, its value, and when to try again.

#ifndef DLCS_SERVER_STORE_REFUSAL_H_
#define DLCS_SERVER_STORE_REFUSAL_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "server/store/clock.h"

namespace dlcs::jobs {

struct Refusal {
  std::string limit;  // its name, as in SchedulerLimits; "deadline" if the job could not finish in time
  double value = 0;   // of the limit
  double requested = 0;
  std::optional<Duration> retry_after;  // absent: never, on this server
};

// RESOURCE_EXHAUSTED with a message, and the refusal as payload.
absl::Status ToStatus(const Refusal& refusal);
// The refusal in a status from ToStatus(); absent in other errors.
std::optional<Refusal> RefusalOf(const absl::Status& status);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_REFUSAL_H_
