// SPDX-License-Identifier: Apache-2.0
// Servers under names: what `dlcs context` keeps.

#ifndef DLCS_CLIENT_CLI_COMMANDS_CONTEXTS_H_
#define DLCS_CLIENT_CLI_COMMANDS_CONTEXTS_H_

#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/commands/server_target.h"

namespace dlcs::client {

// The file is a JSON object, contexts.json in $XDG_CONFIG_HOME/dlcs, else in ~/.config/dlcs. Tokens are not in it, only
// the names of their files.
struct Contexts {
  std::string current;  // empty: none
  std::map<std::string, ServerTarget> targets;
};

// Where the file is, whether or not it is there. Empty where there is neither XDG_CONFIG_HOME nor HOME.
std::string ContextsPath();

// Nothing where there is no file. Errors: InvalidArgument with the file and what is wrong with it.
absl::StatusOr<Contexts> ReadContexts();
// Makes the folder where it is missing. Errors: as AtomicFile.
absl::Status WriteContexts(const Contexts& contexts);

// Errors: InvalidArgument where there is none of that name, with those that there are.
absl::StatusOr<ServerTarget> FindContext(const Contexts& contexts, const std::string& name);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_CONTEXTS_H_
