// SPDX-License-Identifier: Apache-2.0
// The options of `dlcs model`.

#ifndef DLCS_CLIENT_CLI_MODEL_COMMAND_LINE_H_
#define DLCS_CLIENT_CLI_MODEL_COMMAND_LINE_H_

#include <CLI/CLI.hpp>

#include "client/cli/commands/commands.h"

namespace dlcs::client {

// Adds the subcommand, which fills `command`. Options that do not belong to its kind of model are refused.
void AddModel(CLI::App& main, ModelCommand& command);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_MODEL_COMMAND_LINE_H_
