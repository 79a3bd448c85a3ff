// SPDX-License-Identifier: Apache-2.0
// What the commands about jobs share.

#ifndef DLCS_CLIENT_CLI_COMMANDS_JOB_SUPPORT_H_
#define DLCS_CLIENT_CLI_COMMANDS_JOB_SUPPORT_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/commands/job_commands.h"
#include "client/rpc/job_client.h"
#include "client/rpc/problem_client.h"

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

// How long ago `time` was: "12s", "5m", "3h", "2d".
std::string AgeText(const google::protobuf::Timestamp& time);
// Without control characters: whoever wrote it, a terminal shows it.
std::string Harmless(std::string text);

// The whole name of the job that `typed` is, with or without jobs/ in front: its letters or the first of them, as many
// as no other job has; the server is asked for its jobs where they are not all. Errors: InvalidArgument where none or
// several begin so, with them; those of List().
absl::StatusOr<std::string> FindJob(JobClient& client, const std::string& typed, const CallLimits& limits);
// The same of an uploaded problem, "problems/41cb".
absl::StatusOr<std::string> ProblemResolver(ProblemClient& client, const std::string& typed, const CallLimits& limits);

// Shows what happens until the job `command.name`, a whole name, has ended, and exits as solve would. A stop ends the
// watching and not the job.
ExitCode FollowJob(JobClient& client, const WatchCommand& command, const CallLimits& limits);

// Says on standard error how a job that has ended did, and exits as solve would.
ExitCode ConcludeJob(const v1::SolveJob& job);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_JOB_SUPPORT_H_
