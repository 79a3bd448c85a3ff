// SPDX-License-Identifier: Apache-2.0
// dlcs: solves differential linear complementarity systems, here or on a server.

#include <cstdlib>
#include <exception>
#include <new>
#include <type_traits>
#include <variant>

#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "client/cli/command_line.h"
#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"

int main(int argc, char** argv) {
  using namespace dlcs::client;
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);                    // errors are reported in messages of our own
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);  // as in dlcsd
  try {
    const ExitCode code = std::visit(
        [](const auto& command) -> ExitCode {
          if constexpr (std::is_same_v<decltype(command), const ExitCode&>) {
            return command;
          } else {
            return Run(command);
          }
        },
        ParseCommandLine(argc, argv));
    // A command stopped by a signal exits with the code of a killed program, unless it finished anyway.
    const int signal = Interrupt::Signal();
    return code == kServiceFailed && signal != 0 ? 128 + signal : code;
  } catch (const std::bad_alloc&) {
    return PrintError(absl::ResourceExhaustedError("out of memory; ask for fewer steps"), kServiceFailed);
  } catch (const std::exception& error) {
    return PrintError(absl::InternalError(error.what()), kServiceFailed);
  }
}
