// SPDX-License-Identifier: Apache-2.0
// The whole store: jobs and uploaded problems in one database.

#ifndef DLCS_SERVER_STORE_STORE_H_
#define DLCS_SERVER_STORE_STORE_H_

#include "server/store/job_store.h"
#include "server/store/problem_store.h"

namespace dlcs::jobs {

class Store : public JobStore, public ProblemStore {};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_STORE_H_
