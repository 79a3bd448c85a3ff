// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/commands/problem_input.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/output/atomic_file.h"

namespace dlcs::client {

ExitCode Run(const UploadCommand& command) {
  if (IsProblemName(command.problem_path)) {
    return PrintError(absl::InvalidArgumentError(command.problem_path + " is uploaded already; upload takes a file"),
                      kBadInput);
  }
  const auto input = ProblemInput::Read(command.problem_path, {}, command.rule);
  if (!input.ok()) return PrintError(input.status(), kBadInput);
  input->PrintNotes();
  const Interrupt interrupt;
  const auto client = Connect(command.target);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  const auto uploaded = (*client)->problems().Upload(input->Body(), LimitsFor(command.target, interrupt));
  if (!uploaded.ok()) return PrintCallError(uploaded.status(), input->source());
  if (uploaded->existed()) fmt::print(stderr, "dlcs: it was uploaded already\n");
  fmt::print("{}\n", uploaded->problem().name());
  const absl::Status printed = FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

}  // namespace dlcs::client
