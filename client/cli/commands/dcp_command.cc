// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <memory>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/lcp_output.h"
#include "client/cli/output/message_json.h"
#include "client/cli/terminal/progress_ticker.h"
#include "client/cli/terminal/terminal.h"
#include "client/files/json_text.h"
#include "client/files/lcp_file.h"

namespace dlcs::client {

ExitCode Run(const DcpCommand& command) {
  auto request = ReadDcpFile(command.path);
  if (!request.ok()) return PrintError(request.status(), kBadInput);
  request->set_max_step(command.step);
  if (!command.check.empty()) {
    const auto path = ReadPathFile(command.check);
    if (!path.ok()) return PrintError(path.status(), kBadInput);
    *request->mutable_check() = *path;
  }
  const auto backend = MakeBackend(command.server);
  if (!backend.ok()) return PrintError(backend.status(), kBadInput);

  auto wait = std::make_unique<WaitView>("solving the DCP");
  const auto response =
      (*backend)->SolveDcp(*request, {.deadline = std::chrono::duration<double>(command.deadline_s), .stop = {}});
  wait.reset();
  if (!response.ok()) return PrintCallError(response.status(), SourceName(command.path));
  const DcpVerdict verdict = VerdictOf(*request, *response);
  if (command.format == OutputFormat::kJson) {
    fmt::print("{}\n", JsonLine(*response));
  } else {
    PrintDcpTable(*response, verdict, WidthOf(stdout), stdout);
  }
  const absl::Status printed = FlushStream(stdout, "standard output");
  if (!printed.ok()) return PrintError(printed, kServiceFailed);
  return verdict.solved ? kSolved : kNoAnswer;
}

}  // namespace dlcs::client
