// SPDX-License-Identifier: Apache-2.0
// A `dlcs` that runs beside the test, to be sent signals, or that has a terminal.

#ifndef DLCS_TESTS_CLIENT_CLI_RUNNING_PROGRAM_H_
#define DLCS_TESTS_CLIENT_CLI_RUNNING_PROGRAM_H_

#include <sys/types.h>

#include <map>
#include <string>
#include <vector>

#include "tests/client/cli/program.h"

namespace dlcs::client {

// OpenBLAS stands in for LAPACK in it, whose thread is there before main() and takes signals like any other.
class RunningProgram {
 public:
  struct Settings {
    std::map<std::string, std::string> variables = {};  // of the environment; empty: not set
    bool ignores_interrupts = false;                    // as what a shell starts with `&`
    int columns = 0;                                    // of a terminal for all its streams, above 0
  };

  explicit RunningProgram(const std::vector<std::string>& arguments) : RunningProgram(arguments, Settings()) {}
  RunningProgram(const std::vector<std::string>& arguments, const Settings& settings);
  ~RunningProgram();

  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  // Returns when it has printed `text` on standard error, or on the terminal. Fails the test where it ends before.
  void AwaitErrorText(const std::string& text);
  bool HasLoaded(const std::string& library) const;
  // All at once, as far as the program can see.
  void Send(const std::vector<int>& signals);
  // Gives its terminal another width.
  void Resize(int columns) const;
  // What it did, once it has ended. On a terminal everything is in `out`.
  ProgramOutcome Await();

 private:
  // Takes what there is, and waits for it. False where there is nothing more to come.
  bool Read();

  pid_t pid_ = -1;
  bool ended_ = false;
  int output_ = -1;  // the reading ends
  int errors_ = -1;  // -1 with a terminal
  ProgramOutcome outcome_;
};

}  // namespace dlcs::client

#endif  // DLCS_TESTS_CLIENT_CLI_RUNNING_PROGRAM_H_
