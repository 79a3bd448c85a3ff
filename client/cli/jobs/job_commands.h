// SPDX-License-Identifier: Apache-2.0
// The commands of `dlcs` about jobs and ensembles: the options of each, and the function that runs it.

#ifndef DLCS_CLIENT_CLI_JOBS_JOB_COMMANDS_H_
#define DLCS_CLIENT_CLI_JOBS_JOB_COMMANDS_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/result/backend.h"
#include "dlcs/v1/jobs.pb.h"

namespace dlcs::client {

struct EnsembleCommand {
  SolveCommand solve;         // the problem and how to solve its members
  std::string members_path;   // "-" is standard input; empty: the points of .step in a deck
  bool detach = false;        // only create a job on the server, and print its name
  bool extrema = false;       // of a job: also keep the smallest and largest values
  bool has_deadline = false;  // solve.deadline_s was given, and is that of a job too
};

// The options of all commands about jobs.
struct JobTarget {
  ServerTarget server = ServerAt(kDefaultServer);
  // Time limit of the whole command, including lost connections and server restarts.
  double patience_s = 60;
  ConnectionOptions::Repeat repeat = ConnectionOptions::Repeat::kAfterAnswer;
};

// Prints the job's name and nothing else; with `wait` follows it to its end.
struct SubmitCommand {
  JobTarget target;
  SolveCommand solve;  // problem_path, options, grid, rule
  std::string request_id;
  std::string title;  // empty: the problem's name
  bool wait = false;
  bool quiet = false;  // while waiting
  std::int32_t priority = 0;
  std::optional<double> within_s;  // the deadline of the job
  bool validate_only = false;
};

// Prints the problem's name and nothing else.
struct UploadCommand {
  JobTarget target{.server = ServerAt(kDefaultServer), .patience_s = 600};
  std::string problem_path;
  std::optional<v1::SolutionRule> rule;  // overrides the file's
};

// The uploaded problems.
struct ListProblemsCommand {
  JobTarget target;
  OutputFormat format = OutputFormat::kTable;  // table, or JSON: a line each
};

// Shows the events of a job until it has ended, and exits with the code that `solve` would have.
struct WatchCommand {
  JobTarget target{.server = ServerAt(kDefaultServer), .patience_s = 24 * 3600};
  std::string name;
  std::int64_t after = 0;
  double interval_s = 0;
  OutputFormat format = OutputFormat::kTable;  // table, or JSON: every event a line
  bool quiet = false;
  // The values of iterates to print as JSON. Not set: none.
  std::optional<v1::WatchView> values;
  std::vector<std::int32_t> components;  // empty: all
};

// One job or uploaded problem, or where `name` is empty all jobs.
struct ShowJobsCommand {
  JobTarget target;
  std::string name;
  std::vector<v1::JobState> states;
  std::int64_t most = 100;
  OutputFormat format = OutputFormat::kTable;
};

// Cancels a job, or deletes a job or an uploaded problem.
struct EndJobCommand {
  JobTarget target;
  std::string name;
  bool deletes = false;  // delete, not cancel
  bool all = false;      // every job that has ended, or of those the ones in `states`
  std::vector<v1::JobState> states;
};

// Prints the trajectory as `solve` does. With `at`, only the stored times nearest to those.
struct ResultCommand {
  JobTarget target{.server = ServerAt(kDefaultServer), .patience_s = 600};
  std::string name;
  std::int64_t stride = 1;
  double from = 0;
  std::optional<double> to;
  std::vector<double> at;
  OutputFormat format = OutputFormat::kTable;
  std::string output;
};

ExitCode Run(const EnsembleCommand& command);
// The members are solved by `backend`; null: as the command says.
ExitCode Run(const EnsembleCommand& command, std::unique_ptr<Backend> backend);
ExitCode RunSweep(const EnsembleCommand& command, std::unique_ptr<Backend> backend);  // without MEMBERS
ExitCode Run(const SubmitCommand& command);
ExitCode Run(const UploadCommand& command);
ExitCode Run(const ListProblemsCommand& command);
ExitCode Run(const WatchCommand& command);
ExitCode Run(const ShowJobsCommand& command);
ExitCode Run(const EndJobCommand& command);
ExitCode Run(const ResultCommand& command);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_JOBS_JOB_COMMANDS_H_
