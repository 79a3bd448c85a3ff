// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_SERVER_SOLVE_JOBS_JOB_REFUSAL_H_
#define DLCS_SERVER_SOLVE_JOBS_JOB_REFUSAL_H_

#include "absl/status/status.h"

namespace dlcs {

// Adds the google.rpc details to a refusal of the scheduler or the store (server/store/refusal.h); returns any other
// status unchanged.
absl::Status WithDetails(const absl::Status& status);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_JOB_REFUSAL_H_
