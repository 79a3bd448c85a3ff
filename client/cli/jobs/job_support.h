// SPDX-License-Identifier: Apache-2.0
// Functions that the commands about jobs and ensembles share.

#ifndef DLCS_CLIENT_CLI_JOBS_JOB_SUPPORT_H_
#define DLCS_CLIENT_CLI_JOBS_JOB_SUPPORT_H_

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/jobs/job_commands.h"
#include "client/rpc/client.h"

namespace dlcs::client {

// A client that reports repeated calls on standard error. Errors: InvalidArgument with the option.
absl::StatusOr<std::unique_ptr<Client>> Connect(const JobTarget& target);
CallLimits LimitsFor(const JobTarget& target, const Interrupt& interrupt);

// The time in so many seconds, as a deadline.
google::protobuf::Timestamp FromNow(double seconds);

// "queued", "running", ...
std::string JobStateWord(v1::JobState state);
// "queued,running": one or more. Absent if one is not a state.
std::optional<std::vector<v1::JobState>> ParseJobStates(const std::string& words);
std::vector<std::string> JobStateWords();
bool HasEnded(v1::JobState state);

// "2026-11-21 22:50:03 UTC"; "-" where it is not set.
std::string TimeText(const google::protobuf::Timestamp& time);

// How long ago `time` was: "12s", "5m", "3h", "2d".
std::string AgeText(const google::protobuf::Timestamp& time);

// `text` without control characters, so that it can be printed on a terminal.
std::string WithoutControlCharacters(std::string text);

// So many jobs are listed where none may be missed.
inline constexpr std::size_t kAllJobs = 1'000'000;

// The full name of the job `typed`: an id, or the beginning of one that no other job has, with or without jobs/ in
// front. For the beginning of an id it lists the jobs of the server. Errors: InvalidArgument if no job or several jobs
// match, listing them; those of List().
absl::StatusOr<std::string> FindJob(JobClient& client, const std::string& typed, const CallLimits& limits);

// A job on a server, for a command about it.
struct JobOnServer {
  std::unique_ptr<Client> client;
  CallLimits limits;
  std::string name;  // the full one

  JobClient& jobs() const { return client->jobs(); }
};
// Connects to `target` and finds the job `typed` there. Errors: those of Connect() and FindJob().
absl::StatusOr<JobOnServer> ConnectToJob(const JobTarget& target, const std::string& typed, const Interrupt& interrupt);

// The same for an uploaded problem, "problems/41cb".
absl::StatusOr<std::string> FindProblem(ProblemClient& client, const std::string& typed, const CallLimits& limits);

// Shows the events of the job `command.name`, a full name, until it has ended. Returns the exit code that `solve` would
// have. A stop ends the watch, not the job.
ExitCode FollowJob(JobClient& client, const WatchCommand& command, const CallLimits& limits);

// Reads the results of the ensemble `job` until its end, and prints them as `command` requests. Returns the exit code
// that `ensemble` would have. A stop ends the reading, not the job.
ExitCode PrintEnsemble(JobClient& client, const ResultCommand& command, const v1::SolveJob& job,
                       const CallLimits& limits);

// A client of `server`, or of the default one.
absl::StatusOr<std::unique_ptr<Client>> ConnectForJobs(const ServerTarget& server);
// How long creating an ensemble job with this deadline may take: a server that says that the deadline is too soon needs
// some time for that.
double TimeToSubmit(double deadline_s);
// Creates a job for the ensemble in `request`, which lacks its results alone, and prints its name. `source` is the name
// of the problem in messages.
ExitCode SubmitEnsembleJob(const EnsembleCommand& command, Client& client, v1::CreateEnsembleJobRequest request,
                           const std::string& source, const CallLimits& limits);

// The title of a job, or its name.
std::string TitleOf(const v1::SolveJob& job);

// Prints the outcome of a finished job on standard error. Returns the exit code that `solve` would have.
ExitCode ConcludeJob(const v1::SolveJob& job);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_JOBS_JOB_SUPPORT_H_
