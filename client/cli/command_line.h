// SPDX-License-Identifier: Apache-2.0
// Parses the command line of `dlcs`.

#ifndef DLCS_CLIENT_CLI_COMMAND_LINE_H_
#define DLCS_CLIENT_CLI_COMMAND_LINE_H_

#include <variant>

#include "client/cli/commands/commands.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/output/exit_code.h"

namespace dlcs::client {

// A command to run, or the exit code if there is nothing to run: help or the version was printed, or an error in the
// options was printed on standard error.
using ParsedCommandLine =
    std::variant<ExitCode, SolveCommand, EnsembleCommand, AnalyzeCommand, LcpCommand, DcpCommand, ModelCommand,
                 NetlistCommand, PlotCommand, CapabilitiesCommand, HealthCommand, ContextCommand, WorkersCommand,
                 SubmitCommand, UploadCommand, ListProblemsCommand, WatchCommand, ShowJobsCommand, EndJobCommand,
                 ResultCommand>;

ParsedCommandLine ParseCommandLine(int argc, const char* const* argv);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMAND_LINE_H_
