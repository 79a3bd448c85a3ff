// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/terminal.h"
#include "client/netlist/netlist.h"

namespace dlcs::client {

ExitCode Run(const NetlistCommand& command) {
  const auto output = OpenOutput(command.output, {command.path});
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  const auto netlist = ReadNetlistFile(command.path, command.options);
  if (!netlist.ok()) return PrintError(netlist.status(), kBadInput);
  for (const std::string& note : netlist->notes) {
    if (!command.quiet) PrintNotice(note);
  }
  PrintProblemFile(NetlistJson(*netlist), *output ? (*output)->stream() : stdout);
  const absl::Status printed = *output ? (*output)->Commit() : FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

}  // namespace dlcs::client
