// SPDX-License-Identifier: Apache-2.0
// dlcs: solves differential linear complementarity systems, here or on a server.

#include <exception>
#include <type_traits>
#include <variant>

#include "absl/status/status.h"
#include "client/cli/command_line.h"
#include "client/cli/run_support.h"

int main(int argc, char** argv) {
  using namespace dlcs::client;
  try {
    return std::visit(
        [](const auto& command) -> ExitCode {
          if constexpr (std::is_same_v<decltype(command), const ExitCode&>) {
            return command;
          } else {
            return Run(command);
          }
        },
        ParseCommandLine(argc, argv));
  } catch (const std::exception& error) {
    // Out of memory, most likely: nothing of ours throws.
    return Complain(absl::InternalError(error.what()), kServiceFailed);
  }
}
