// SPDX-License-Identifier: Apache-2.0
// What a solve on many processes does in its own way.

#ifndef DLCS_CLIENT_CLI_COMMANDS_SOLVE_WAYS_H_
#define DLCS_CLIENT_CLI_COMMANDS_SOLVE_WAYS_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/commands.h"
#include "client/files/matrix_files.h"
#include "client/result/backend.h"

namespace dlcs::client {

// What is empty is done as in any other solve.
struct SolveWays {
  MatrixFiles matrix_files;
  std::unique_ptr<Backend> backend;
  // Writes a result whose trajectory is not in one process, to the new file at `path`; empty in processes that write
  // none. Returns nothing where the trajectory is in this process.
  std::function<std::optional<absl::Status>(const std::string& title, const SolveResult& result,
                                            const std::string& path)>
      write_arrays;
};

// Run() of such a solve, in each of the processes.
ExitCode Run(const SolveCommand& command, SolveWays ways);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_SOLVE_WAYS_H_
