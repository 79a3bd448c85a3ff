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
#include "client/files/json_text.h"
#include "client/files/lcp_file.h"

namespace dlcs::client {

ExitCode Run(const LcpCommand& command) {
  auto request = ReadLcpFile(command.path);
  if (!request.ok()) return PrintError(request.status(), kBadInput);
  if (command.rule) request->set_rule(*command.rule);
  request->set_all_basic_solutions(command.all);
  const auto backend = MakeBackend(command.server);
  if (!backend.ok()) return PrintError(backend.status(), kBadInput);

  auto wait = std::make_unique<WaitView>("solving the LCP");
  const auto response =
      (*backend)->SolveLcp(*request, {.deadline = std::chrono::duration<double>(command.deadline_s), .stop = {}});
  wait.reset();
  if (!response.ok()) return PrintCallError(response.status(), SourceName(command.path));
  command.format == OutputFormat::kJson ? fmt::print("{}\n", JsonLine(*response)) : PrintLcpTable(*response, stdout);
  const absl::Status printed = FlushStream(stdout, "standard output");
  if (!printed.ok()) return PrintError(printed, kServiceFailed);
  return response->verdict() == v1::LCP_STATUS_SOLVED ? kSolved : kNoAnswer;
}

}  // namespace dlcs::client
