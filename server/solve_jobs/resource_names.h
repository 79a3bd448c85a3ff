// SPDX-License-Identifier: Apache-2.0
// The names of jobs and problems in messages.

#ifndef DLCS_SERVER_SOLVE_JOBS_RESOURCE_NAMES_H_
#define DLCS_SERVER_SOLVE_JOBS_RESOURCE_NAMES_H_

#include <string>

#include "absl/status/statusor.h"
#include "server/store/job.h"
#include "server/store/problem_store.h"

namespace dlcs {

// "jobs/ID", and back. Errors: InvalidArgument if the text is not the name of a job.
std::string JobName(const jobs::JobId& id);
absl::StatusOr<jobs::JobId> JobIdOf(const std::string& name);

// "problems/ID", and back. Errors: InvalidArgument for `field` if the text is not the name of a problem.
std::string ProblemName(const jobs::ProblemId& id);
absl::StatusOr<jobs::ProblemId> ProblemIdOf(const std::string& name, const char* field = "name");

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_RESOURCE_NAMES_H_
