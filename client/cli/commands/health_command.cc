// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <string>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/atomic_file.h"
#include "client/rpc/health.h"

namespace dlcs::client {
namespace {

// The message about a server that answers but does not serve.
std::string Explain(Health health, const HealthCommand& command) {
  const std::string& address = command.server.address;
  const std::string what = command.service.empty() ? "" : " " + command.service;
  switch (health) {
    case Health::kServiceUnknown:
      return fmt::format(
          "the server at {} has no service \"{}\". Every dlcsd but a worker has dlcs.v1.SolverService, one with "
          "--store dlcs.v1.JobService",
          address, command.service);
    case Health::kNotServing:
      return fmt::format("the server at {} does not serve{}: it is shutting down{}", address, what,
                         command.service.empty() ? "" : ", or its store does not answer. Its log says which");
    default:
      return fmt::format("the server at {} does not say whether it serves{}", address, what);
  }
}

}  // namespace

ExitCode Run(const HealthCommand& command) {
  const auto options = ConnectionTo(command.server);
  if (!options.ok()) return PrintError(options.status(), kBadInput);
  const auto health = CheckHealth(*options, command.service,
                                  {.deadline = std::chrono::duration<double>(command.deadline_s), .stop = {}});
  if (!health.ok()) return PrintError(InOptions(health.status(), command.server), ExitCodeOf(health.status()));
  fmt::print("{}\n", HealthName(*health));
  const absl::Status printed = FlushStream(stdout, "standard output");
  if (!printed.ok()) return PrintError(printed, kServiceFailed);
  if (*health == Health::kServing) return kSolved;
  fmt::print(stderr, "dlcs: {}\n", Explain(*health, command));
  return kNoAnswer;
}

}  // namespace dlcs::client
