// SPDX-License-Identifier: Apache-2.0
// All that one database keeps.

#ifndef DLCS_SERVER_JOBS_STORE_H_
#define DLCS_SERVER_JOBS_STORE_H_

#include "server/jobs/job_store.h"
#include "server/jobs/problem_store.h"

namespace dlcs::jobs {

class Store : public JobStore, public ProblemStore {};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_STORE_H_
