// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_SERVER_SOLVE_JOBS_JOB_REFUSAL_H_
#define DLCS_SERVER_SOLVE_JOBS_JOB_REFUSAL_H_

#include "absl/status/status.h"

namespace dlcs {

// A refusal of the scheduler or of the store (jobs/refusal.h) with the details that the wire has for it; any other
// status as it is.
absl::Status WithDetails(const absl::Status& status);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_JOB_REFUSAL_H_
