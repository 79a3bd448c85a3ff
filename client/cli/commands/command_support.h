// SPDX-License-Identifier: Apache-2.0
// What every command does: choose where to run, complain in one way.

#ifndef DLCS_CLIENT_CLI_COMMANDS_COMMAND_SUPPORT_H_
#define DLCS_CLIENT_CLI_COMMANDS_COMMAND_SUPPORT_H_

#include <cstdio>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/commands/server_target.h"
#include "client/cli/output/exit_code.h"
#include "client/result/backend.h"

namespace dlcs::client {

// The server at `server`, or this process where that has no address. A server that was not typed is named on standard
// error, unless `quiet`. Errors: InvalidArgument with the option.
absl::StatusOr<std::unique_ptr<Backend>> MakeBackend(const ServerTarget& server, bool quiet = false);

// Prints a notice on standard error: a cut that is gone on behind, a repetition.
void PrintNotice(const std::string& text);

// Prints each line of the message behind "dlcs: " on standard error. `code` is handed through.
ExitCode PrintError(const absl::Status& status, ExitCode code);

// The same for an error of a call about `source`, the name of the input file: a line that names a field of
// the file gets the file's name, one that names an option the option's ("steps" is --steps).
ExitCode PrintCallError(const absl::Status& status, const std::string& source);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_COMMAND_SUPPORT_H_
