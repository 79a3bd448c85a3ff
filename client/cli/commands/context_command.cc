// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/contexts.h"
#include "client/cli/output/atomic_file.h"
#include "client/rpc/connection.h"

namespace dlcs::client {
namespace {

void PrintRow(const std::string& name, const ServerTarget& target, bool current) {
  const bool encrypted = target.tls || !target.tls_ca.empty() || !target.tls_cert.empty();
  fmt::print("{} {:<16}  {}{}{}\n", current ? '*' : ' ', name, target.address, encrypted ? ", encrypted" : "",
             target.token_file.empty() ? "" : ", token of " + target.token_file);
}

ExitCode List(const Contexts& contexts) {
  for (const auto& [name, target] : contexts.targets) PrintRow(name, target, name == contexts.current);
  const absl::Status printed = FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

// So that the context means the same from every folder.
ServerTarget WithAbsolutePaths(ServerTarget target) {
  for (std::string ServerTarget::*path :
       {&ServerTarget::tls_ca, &ServerTarget::tls_cert, &ServerTarget::tls_key, &ServerTarget::token_file}) {
    if (!(target.*path).empty()) target.*path = std::filesystem::absolute(target.*path).lexically_normal().string();
  }
  return target;
}

absl::Status Change(const ContextCommand& command, Contexts& contexts) {
  if (command.action == ContextCommand::Action::kSet) {
    if (absl::Status address = CheckAddress(command.server.address); !address.ok()) {
      return InOptions(address, command.server);
    }
    contexts.targets[command.name] = WithAbsolutePaths(command.server);
    return absl::OkStatus();
  }
  if (!command.name.empty()) {
    const auto found = FindContext(contexts, command.name);
    if (!found.ok()) return found.status();
  }
  if (command.action == ContextCommand::Action::kUse) {
    contexts.current = command.name;
    return absl::OkStatus();
  }
  contexts.targets.erase(command.name);
  if (contexts.current == command.name) contexts.current.clear();
  return absl::OkStatus();
}

}  // namespace

ExitCode Run(const ContextCommand& command) {
  absl::StatusOr<Contexts> contexts = ReadContexts();
  if (!contexts.ok()) return PrintError(contexts.status(), kBadInput);
  if (command.action == ContextCommand::Action::kList) return List(*contexts);
  absl::Status changed = Change(command, *contexts);
  if (changed.ok()) changed = WriteContexts(*contexts);
  return changed.ok() ? kSolved : PrintError(changed, kBadInput);
}

}  // namespace dlcs::client
