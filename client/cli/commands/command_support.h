// SPDX-License-Identifier: Apache-2.0
// Functions that all commands share: choosing where to run, printing errors.

#ifndef DLCS_CLIENT_CLI_COMMANDS_COMMAND_SUPPORT_H_
#define DLCS_CLIENT_CLI_COMMANDS_COMMAND_SUPPORT_H_

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/commands/server_target.h"
#include "client/cli/output/exit_code.h"
#include "client/result/backend.h"

namespace dlcs::client {

// The server at `server`, or this process if that has no address. A server from the environment or a context is named
// on standard error, unless `quiet`. Errors: InvalidArgument with the option.
absl::StatusOr<std::unique_ptr<Backend>> MakeBackend(const ServerTarget& server, bool quiet = false);

// Makes it where `backend` is null.
absl::Status MakeIfAbsent(const ServerTarget& server, bool quiet, std::unique_ptr<Backend>& backend);

// Prints a notice on standard error, for example that a call is repeated or a solve is resumed.
void PrintNotice(const std::string& text);

// Prints a problem file: a key on each line, a matrix in one, as people write such files.
void PrintProblemFile(const nlohmann::ordered_json& file, std::FILE* out);

// Prints each line of the message after "dlcs: " on standard error. Returns `code`.
ExitCode PrintError(const absl::Status& status, ExitCode code);

// The same for an error of a call about `source`, the name of the input file. A violation of the request is named as
// the user knows it: a field of the file with the file's name, an option by its flag (options.steps is --steps).
// `members` is the name of the file with the members of an ensemble.
ExitCode PrintCallError(const absl::Status& status, const std::string& source, const std::string& members = "");

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_COMMAND_SUPPORT_H_
