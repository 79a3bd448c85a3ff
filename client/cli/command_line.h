// SPDX-License-Identifier: Apache-2.0
// The command line of `dlcs` in words.

#ifndef DLCS_CLIENT_CLI_COMMAND_LINE_H_
#define DLCS_CLIENT_CLI_COMMAND_LINE_H_

#include <variant>

#include "client/cli/commands/commands.h"
#include "client/cli/commands/job_commands.h"
#include "client/cli/output/exit_code.h"

namespace dlcs::client {

// A command to run, or the exit code when there is nothing more to do: help or the version was printed, or
// the options break a rule and that was said on standard error.
using ParsedCommandLine =
    std::variant<ExitCode, SolveCommand, EnsembleCommand, AnalyzeCommand, LcpCommand, DcpCommand, ModelCommand,
                 CapabilitiesCommand, HealthCommand, ContextCommand, SubmitCommand, UploadCommand, ListProblemsCommand,
                 WatchCommand, ShowJobsCommand, EndJobCommand, ResultCommand>;

ParsedCommandLine ParseCommandLine(int argc, const char* const* argv);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMAND_LINE_H_
