// SPDX-License-Identifier: Apache-2.0
// The settings of a server as limits of jobs and uploads, and as reported to clients.

#ifndef DLCS_SERVER_SOLVE_JOBS_JOB_LIMITS_H_
#define DLCS_SERVER_SOLVE_JOBS_JOB_LIMITS_H_

#include "dlcs/v1/solver.pb.h"
#include "server/config/server_config.h"
#include "server/jobs/job_manager.h"
#include "server/session/request_check.h"
#include "server/solve_jobs/problem_library.h"
#include "server/solve_jobs/rank_launcher.h"

namespace dlcs {

inline constexpr int kMaxPriority = 100;
// The largest minimum interval of a watch; longer ones are reduced to it.
inline constexpr std::chrono::seconds kMaxWatchInterval{3600};

// `config` is resolved.
jobs::JobManagerOptions ToJobManagerOptions(const ServerConfig& config);
UploadLimits ToUploadLimits(const ServerConfig& config);
RankSettings RankSettingsOf(const ServerConfig& config);
// ToSessionLimits() for a solve that runs as a job: it may ask for ranks.
SessionLimits ToJobLimits(const ServerConfig& config);

// The limits in the response of GetCapabilities.
v1::JobLimits JobLimitsToProto(const jobs::JobManagerOptions& options, int max_ranks);
v1::UploadLimits UploadLimitsToProto(const ServerConfig& config);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_JOB_LIMITS_H_
