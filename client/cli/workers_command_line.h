// SPDX-License-Identifier: Apache-2.0
// The options of `dlcs workers`.

#ifndef DLCS_CLIENT_CLI_WORKERS_COMMAND_LINE_H_
#define DLCS_CLIENT_CLI_WORKERS_COMMAND_LINE_H_

#include <CLI/CLI.hpp>

#include "client/cli/commands/commands.h"

namespace dlcs::client {

// Adds the subcommand with one of its own for each manager of machines, which fills `command`.
void AddWorkers(CLI::App& main, WorkersCommand& command);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_WORKERS_COMMAND_LINE_H_
