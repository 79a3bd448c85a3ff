// SPDX-License-Identifier: Apache-2.0
#include "tests/client/program.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace dlcs::client {

ProgramOutcome RunDlcs(const std::string& arguments, const std::string& prefix) {
  std::string errors = testing::TempDir() + "dlcs-errors-XXXXXX";
  close(mkstemp(errors.data()));
  const std::string command = prefix + "'" DLCS_PROGRAM "' " + arguments + " 2>'" + errors + "'";
  ProgramOutcome outcome;
  std::FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 4096> block;
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe)) {
    outcome.out.append(block.data(), count);
  }
  const int status = pclose(pipe);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  std::ifstream stream(errors);
  outcome.err.assign(std::istreambuf_iterator<char>(stream), {});
  std::filesystem::remove(errors);
  return outcome;
}

}  // namespace dlcs::client
