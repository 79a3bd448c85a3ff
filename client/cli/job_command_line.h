// SPDX-License-Identifier: Apache-2.0
// The commands about jobs on the command line.

#ifndef DLCS_CLIENT_CLI_JOB_COMMAND_LINE_H_
#define DLCS_CLIENT_CLI_JOB_COMMAND_LINE_H_

#include <CLI/CLI.hpp>

#include "client/cli/jobs/job_commands.h"

namespace dlcs::client {

struct JobCommands {
  SubmitCommand submit;
  UploadCommand upload;
  ListProblemsCommand problems;
  WatchCommand watch;
  ShowJobsCommand get, list;
  EndJobCommand cancel, remove;
  ResultCommand result;
};

// Adds submit, watch, get, list, cancel, delete, result, upload and problems, which fill `commands`; it must outlive
// `main`.
void AddJobCommands(CLI::App& main, JobCommands& commands);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_JOB_COMMAND_LINE_H_
