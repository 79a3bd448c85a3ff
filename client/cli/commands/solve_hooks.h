// SPDX-License-Identifier: Apache-2.0
// Hooks for a solve on many processes.

#ifndef DLCS_CLIENT_CLI_COMMANDS_SOLVE_HOOKS_H_
#define DLCS_CLIENT_CLI_COMMANDS_SOLVE_HOOKS_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/commands.h"
#include "client/files/matrix_files.h"
#include "client/result/backend.h"

namespace dlcs::client {

// Empty members have no effect.
struct SolveHooks {
  MatrixFiles matrix_files;
  std::unique_ptr<Backend> backend;
  // Writes a result whose trajectory is distributed over processes to the new file at `path`, which is empty in
  // processes that write no file. Absent if the trajectory is in this process.
  std::function<std::optional<absl::Status>(const std::string& title, const SolveResult& result,
                                            const std::string& path)>
      write_arrays;
};

// Run() of such a solve, in each of the processes.
ExitCode Run(const SolveCommand& command, SolveHooks hooks);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_SOLVE_HOOKS_H_
