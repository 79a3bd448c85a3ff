// SPDX-License-Identifier: Apache-2.0
// Starts the ranks of MPI that share a solve, with a launcher such as mpirun.

#ifndef DLCS_SERVER_SOLVE_JOBS_RANK_LAUNCHER_H_
#define DLCS_SERVER_SOLVE_JOBS_RANK_LAUNCHER_H_

#include <sys/types.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dlcs {

struct RankSettings {
  std::string launcher;  // "mpirun -n {ranks}"; empty: none
  std::string program;   // dlcs-mpi: a path, or a name to find in the folder of this program or in PATH
  std::string host;      // name or address at which ranks reach this machine
  // A rank that does not respond to pings for this long counts as lost.
  std::chrono::milliseconds patience{30'000};
};

// Names of the environment variables with the address of the worker, and with the secret by which the worker recognizes
// its ranks. Launchers pass the environment to ranks, and print all their output, so nothing secret is printed.
inline constexpr char kWorkerVariable[] = "DLCS_MPI_WORKER";
inline constexpr char kSecretVariable[] = "DLCS_MPI_SECRET";

// Splits the command of a launcher into words at blanks; single or double quotes protect blanks. Errors:
// InvalidArgument if there is no {ranks}, or a quote is not closed.
absl::StatusOr<std::vector<std::string>> SplitLauncher(const std::string& launcher);

// OK if this process can execute the launcher and the program. Errors: InvalidArgument naming the flag.
absl::Status CheckRankSettings(const RankSettings& settings);

// A running launcher with all its child processes. Not thread-safe.
class RankLauncher {
 public:
  // Starts `ranks` ranks of the program, with `variables` in addition to the environment of this process. Their output,
  // standard output too, is logged under `name`. Errors: FailedPrecondition if the launcher cannot be started.
  static absl::StatusOr<std::unique_ptr<RankLauncher>> Start(
      const RankSettings& settings, int ranks, const std::vector<std::pair<std::string, std::string>>& variables,
      std::string name);
  // End().
  ~RankLauncher();
  RankLauncher(const RankLauncher&) = delete;
  RankLauncher& operator=(const RankLauncher&) = delete;

  // Waits at most `timeout` for the launcher to end, and logs its output. Returns whether it has ended.
  bool Wait(std::chrono::milliseconds timeout);
  // Ends the launcher and its process group: sends SIGTERM, waits some seconds, and sends SIGKILL.
  void End();

  // How the launcher ended, as text with its last output. Call it after the end.
  std::string HowItEnded() const;
  // Whether the launcher or, by the exit code of the launcher, a rank was killed by a signal. Another attempt may then
  // succeed. Call it after the end.
  bool WasKilled() const;

 private:
  RankLauncher(pid_t process, int output, std::string name)
      : process_(process), output_(output), name_(std::move(name)) {}

  void ReadOutput();
  void Log(const std::string& line);

  const pid_t process_;
  int output_;  // the reading end of a pipe; -1 after the end of the output
  const std::string name_;
  std::optional<int> status_;      // of waitpid()
  std::string line_;               // incomplete line of output
  std::vector<std::string> last_;  // last lines of output, without those of crashes
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_RANK_LAUNCHER_H_
