// SPDX-License-Identifier: Apache-2.0
// A `dlcs` that runs while the test does, which can send it signals or give it a terminal.

#ifndef DLCS_TESTS_CLIENT_CLI_RUNNING_PROGRAM_H_
#define DLCS_TESTS_CLIENT_CLI_RUNNING_PROGRAM_H_

#include <sys/types.h>

#include <map>
#include <string>
#include <vector>

#include "tests/client/cli/program.h"

namespace dlcs::client {

// It uses OpenBLAS as LAPACK, whose thread exists before main() and receives signals like any other.
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

  // Returns when it has printed `text` on standard error, or on the terminal. Fails the test if it ends before.
  void AwaitErrorText(const std::string& text);
  bool HasLoaded(const std::string& library) const;
  // Sends all signals at once, as far as the program can see.
  void Send(const std::vector<int>& signals);
  // Changes the width of its terminal.
  void Resize(int columns) const;
  // Waits for the end, and returns the outcome. On a terminal all output is in `out`.
  ProgramOutcome Await();

 private:
  // Waits for output and reads it. False at the end of the output.
  bool Read();

  pid_t pid_ = -1;
  bool ended_ = false;
  int output_ = -1;  // the reading ends of the pipes
  int errors_ = -1;  // -1 with a terminal
  ProgramOutcome outcome_;
};

}  // namespace dlcs::client

#endif  // DLCS_TESTS_CLIENT_CLI_RUNNING_PROGRAM_H_
