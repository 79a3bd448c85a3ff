// SPDX-License-Identifier: Apache-2.0
#include "tests/server/dlcsd_process.h"

#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

#include "tests/support/paths.h"

extern char** environ;

namespace dlcs::testing {

DlcsdProcess::DlcsdProcess(const std::vector<std::string>& flags, const std::vector<std::string>& environment) {
  int output[2];
  if (pipe(output) != 0) throw std::runtime_error("pipe");
  // Errors are written to an unnamed file, so that nobody must read them while the program runs.
  char name[] = "/tmp/dlcsd-test-XXXXXX";
  errors_ = mkstemp(name);
  unlink(name);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors_, STDERR_FILENO);
  posix_spawn_file_actions_addclose(&actions, output[0]);
  posix_spawn_file_actions_addclose(&actions, output[1]);
  std::vector<std::string> words = {DlcsdProgram()};
  words.insert(words.end(), flags.begin(), flags.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::vector<std::string> variables = environment;
  std::vector<char*> all_variables;
  for (std::string& variable : variables) all_variables.push_back(variable.data());
  for (char** variable = environ; *variable != nullptr; ++variable) all_variables.push_back(*variable);
  all_variables.push_back(nullptr);
  const int error =
      posix_spawn(&pid_, words.front().c_str(), &actions, nullptr, arguments.data(), all_variables.data());
  posix_spawn_file_actions_destroy(&actions);
  close(output[1]);
  output_ = output[0];
  if (error != 0) throw std::runtime_error("cannot start " + words.front());
}

DlcsdProcess::~DlcsdProcess() {
  if (pid_ > 0) {
    Signal(SIGKILL);
    Wait();
  }
  close(output_);
  close(errors_);
}

std::string DlcsdProcess::ReadLine() {
  std::string line;
  for (char character; read(output_, &character, 1) == 1 && character != '\n';) line += character;
  return line;
}

std::string DlcsdProcess::ReadOutput() {
  std::string text;
  for (char character; read(output_, &character, 1) == 1;) text += character;
  return text;
}

std::string DlcsdProcess::ReadAddress() {
  const std::string line = ReadLine();
  const std::string prefix = "dlcsd listening on ";
  return line.compare(0, prefix.size(), prefix) == 0 ? line.substr(prefix.size()) : std::string();
}

void DlcsdProcess::Signal(int signal) { kill(pid_, signal); }

int DlcsdProcess::Wait() {
  int status = 0;
  rusage usage{};
  wait4(pid_, &status, 0, &usage);
  peak_bytes_ = std::int64_t{usage.ru_maxrss} * 1024;
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

std::string DlcsdProcess::ReadErrors() {
  std::string text;
  lseek(errors_, 0, SEEK_SET);
  char buffer[4096];
  for (ssize_t count; (count = read(errors_, buffer, sizeof(buffer))) > 0;) text.append(buffer, count);
  return text;
}

std::int64_t DlcsdProcess::ResidentBytes() const {
  std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
  std::int64_t total_pages = 0;
  std::int64_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * sysconf(_SC_PAGESIZE);
}

}  // namespace dlcs::testing
