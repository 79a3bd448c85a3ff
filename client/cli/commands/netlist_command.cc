// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <string>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/terminal/terminal.h"
#include "client/netlist/netlist.h"
#include "dlcs/v1/problems.pb.h"
#include "proto/shared/title_limit.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {

ExitCode Run(const NetlistCommand& command) {
  const auto output = OpenOutput(command.output, {command.path});
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  const auto netlist = ReadNetlistFile(command.path, command.options);
  if (!netlist.ok()) return PrintError(netlist.status(), kBadInput);
  for (const std::string& note : netlist->notes) {
    if (!command.quiet) PrintNotice(note);
  }
  std::FILE* const out = *output ? (*output)->stream() : stdout;
  if (command.message) {
    v1::ProblemBody body;
    *body.mutable_problem() = netlist->problem;
    body.set_title(TruncateUtf8(netlist->title, kMaxTitleBytes));
    const std::string bytes = body.SerializeAsString();
    std::fwrite(bytes.data(), 1, bytes.size(), out);
  } else {
    PrintProblemFile(NetlistJson(*netlist), out);
  }
  const absl::Status printed = *output ? (*output)->Commit() : FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

}  // namespace dlcs::client
