// SPDX-License-Identifier: Apache-2.0
// Scripts that complete the command line of `dlcs` in shells.

#ifndef DLCS_CLIENT_CLI_COMPLETION_H_
#define DLCS_CLIENT_CLI_COMPLETION_H_

#include <string>

namespace CLI {
class App;
}

namespace dlcs::client {

// The script for "bash", "zsh" or "fish" that completes the commands and options of `app`, the words that an option
// takes, and names of files.
std::string CompletionScript(const CLI::App& app, const std::string& shell);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMPLETION_H_
