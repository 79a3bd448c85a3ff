// SPDX-License-Identifier: Apache-2.0
// Named servers, as managed by `dlcs context`, and the server that a command means.

#ifndef DLCS_CLIENT_CLI_COMMANDS_CONTEXTS_H_
#define DLCS_CLIENT_CLI_COMMANDS_CONTEXTS_H_

#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/commands/server_target.h"

namespace dlcs::client {

// The file is a JSON object, contexts.json in $XDG_CONFIG_HOME/dlcs, else in ~/.config/dlcs. It holds no tokens, only
// the names of their files.
struct Contexts {
  std::string current;  // empty: none
  std::map<std::string, ServerTarget> targets;
};

// The path of the file, which need not exist. Empty if neither XDG_CONFIG_HOME nor HOME is set.
std::string ContextsPath();

// Empty if there is no file. Errors: InvalidArgument with the file and what is wrong with it.
absl::StatusOr<Contexts> ReadContexts();
// Creates the folder if it does not exist. Errors: as AtomicFile.
absl::Status WriteContexts(const Contexts& contexts);

// Errors: InvalidArgument if there is none with this name, listing the existing ones.
absl::StatusOr<ServerTarget> FindContext(const Contexts& contexts, const std::string& name);

// Completes what was not typed from the first of these that exists: the context of --context; the address DLCS_SERVER;
// the context named by DLCS_CONTEXT; the current context. Typed options override those of a context.
// Errors: InvalidArgument with the option or the variable, and the rule.
absl::Status Complete(ServerTarget& target);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_CONTEXTS_H_
