// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/workers_file.h"
#include "client/cli/output/atomic_file.h"

namespace dlcs::client {
namespace {

absl::Status Check(const WorkersCommand& command) {
  if (command.manager != WorkersCommand::Manager::kKubernetes) return absl::OkStatus();
  if (command.time_limit_s > 0 && command.exit_when_idle_s == 0) {
    return absl::InvalidArgumentError("--time-limit: is for a Job; add --exit-when-idle");
  }
  return absl::OkStatus();
}

}  // namespace

ExitCode Run(const WorkersCommand& command) {
  if (const absl::Status checked = Check(command); !checked.ok()) return PrintError(checked, kBadInput);
  const auto output = OpenOutput(command.output);
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  const bool slurm = command.manager == WorkersCommand::Manager::kSlurm;
  const std::string text = slurm ? SlurmScript(command) : KubernetesManifest(command);
  std::fputs(text.c_str(), *output ? (*output)->stream() : stdout);
  const absl::Status printed = *output ? (*output)->Commit() : FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

}  // namespace dlcs::client
