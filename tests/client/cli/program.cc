// SPDX-License-Identifier: Apache-2.0
#include "tests/client/cli/program.h"

#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/support/paths.h"

namespace dlcs::client {

namespace {

// Servers that the person who runs the tests has configured are not used.
void ForgetServers() {
  for (const char* variable : {"DLCS_SERVER", "DLCS_CONTEXT"}) unsetenv(variable);
  setenv("XDG_CONFIG_HOME", ::testing::TempDir().append("no-such-folder").c_str(), /*replace=*/1);
}

}  // namespace

ProgramOutcome RunDlcs(const std::string& arguments, const std::string& prefix) {
  std::string errors = ::testing::TempDir() + "dlcs-errors-XXXXXX";
  close(mkstemp(errors.data()));
  std::string command = prefix + "'" + dlcs::testing::DlcsProgram() + "' " + arguments + " 2>'" + errors + "'";
  ForgetServers();
  ProgramOutcome outcome;
  int output[2];
  if (pipe(output) != 0) throw std::runtime_error("pipe");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
  posix_spawn_file_actions_addclose(&actions, output[0]);
  posix_spawn_file_actions_addclose(&actions, output[1]);
  std::string shell = "sh", option = "-c";
  char* const words[] = {shell.data(), option.data(), command.data(), nullptr};
  pid_t pid = -1;
  const int error = posix_spawn(&pid, "/bin/sh", &actions, nullptr, words, environ);
  posix_spawn_file_actions_destroy(&actions);
  close(output[1]);
  if (error != 0) throw std::runtime_error("cannot start /bin/sh");
  std::array<char, 4096> block;
  for (ssize_t count; (count = read(output[0], block.data(), block.size())) > 0;) {
    outcome.out.append(block.data(), static_cast<std::size_t>(count));
  }
  close(output[0]);
  int status = 0;
  rusage usage{};  // of the shell and of what it ran
  wait4(pid, &status, 0, &usage);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.peak_bytes = std::int64_t{usage.ru_maxrss} * 1024;
  std::ifstream stream(errors);
  outcome.err.assign(std::istreambuf_iterator<char>(stream), {});
  std::filesystem::remove(errors);
  return outcome;
}

ProgramOutcome SolveText(const std::string& json, const std::string& options) {
  return RunDlcs("solve - " + options, "echo '" + json + "' | ");
}

}  // namespace dlcs::client
