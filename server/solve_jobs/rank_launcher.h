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
  std::string program;   // dlcs-mpi: a path, or a name that is looked for beside this program and then in PATH
  std::string host;      // of this machine, as ranks reach it
  // A rank that gives no sign of life for this long is missed.
  std::chrono::milliseconds patience{30'000};
};

// Names of the variables that tell ranks where their worker is, and prove to the worker that they are its ranks.
// Launchers pass the environment on, and print what ranks print: nothing secret goes through a pipe.
inline constexpr char kWorkerVariable[] = "DLCS_MPI_WORKER";
inline constexpr char kSecretVariable[] = "DLCS_MPI_SECRET";

// The words of a launcher, apart by blanks; quotes, single or double, keep blanks. Errors: InvalidArgument where there
// is no {ranks}, or a quote does not close.
absl::StatusOr<std::vector<std::string>> SplitLauncher(const std::string& launcher);

// OK if launcher and program are there and can be run, by this process. Errors: InvalidArgument naming the flag.
absl::Status CheckRankSettings(const RankSettings& settings);

// A launcher that runs, with all that it starts. From one thread.
class RankLauncher {
 public:
  // Starts `ranks` ranks of the program, with these variables in addition to those of this process. What they print,
  // on standard output too, goes into the log under `name`. Errors: FailedPrecondition where it cannot be started.
  static absl::StatusOr<std::unique_ptr<RankLauncher>> Start(
      const RankSettings& settings, int ranks, const std::vector<std::pair<std::string, std::string>>& variables,
      std::string name);
  // End().
  ~RankLauncher();
  RankLauncher(const RankLauncher&) = delete;
  RankLauncher& operator=(const RankLauncher&) = delete;

  // Waits at most `timeout` for the launcher to end, and passes on what is printed. Returns whether it has ended.
  bool Wait(std::chrono::milliseconds timeout);
  // Ends the launcher and its process group: asks it to, waits some seconds, and kills them.
  void End();

  // Where it has ended: in words, with what was printed last.
  std::string HowItEnded() const;
  // Where it has ended: whether it or a rank was killed by a signal, as launchers say by their exit code. Then another
  // attempt may succeed.
  bool WasKilled() const;

 private:
  RankLauncher(pid_t process, int output, std::string name)
      : process_(process), output_(output), name_(std::move(name)) {}

  void ReadOutput();
  void Log(const std::string& line);

  const pid_t process_;
  int output_;  // a pipe; -1 after its end
  const std::string name_;
  std::optional<int> status_;  // of waitpid()
  std::string line_;           // that is not complete yet
  std::string last_;           // lines
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_RANK_LAUNCHER_H_
