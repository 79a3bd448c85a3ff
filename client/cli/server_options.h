// SPDX-License-Identifier: Apache-2.0
// The options that say which server to call, and how. Includes CLI11; only for parsing the command line.

#ifndef DLCS_CLIENT_CLI_SERVER_OPTIONS_H_
#define DLCS_CLIENT_CLI_SERVER_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <string>

#include "client/cli/commands/server_target.h"

namespace dlcs::client {

// Adds --server, described by `help`, and the other options of `target`.
void AddServer(CLI::App& app, ServerTarget& target, const std::string& help);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_SERVER_OPTIONS_H_
