// SPDX-License-Identifier: Apache-2.0
// What the commands about jobs share.

#ifndef DLCS_CLIENT_CLI_JOB_SUPPORT_H_
#define DLCS_CLIENT_CLI_JOB_SUPPORT_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/interrupt.h"
#include "client/cli/job_commands.h"
#include "client/job_client.h"
#include "client/problem_client.h"

namespace dlcs::client {

// Clients that tell every repetition on standard error. Errors: InvalidArgument with the option.
absl::StatusOr<std::unique_ptr<JobClient>> ConnectToJobs(const JobTarget& target);
absl::StatusOr<std::unique_ptr<ProblemClient>> ConnectToProblems(const JobTarget& target);
CallLimits LimitsFor(const JobTarget& target, const Interrupt& interrupt);

// "queued", "running", ...
std::string JobStateWord(v1::JobState state);
// "queued,running": one or more. Nothing where one is no state.
std::optional<std::vector<v1::JobState>> ParseJobStates(const std::string& words);
std::vector<std::string> JobStateWords();
bool HasEnded(v1::JobState state);

// "2026-11-21 22:50:03 UTC"; "-" where it is not set.
std::string TimeText(const google::protobuf::Timestamp& time);

// Says on standard error how a job that has ended did, and exits as solve would.
ExitCode ConcludeJob(const v1::SolveJob& job);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_JOB_SUPPORT_H_
