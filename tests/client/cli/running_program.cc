// SPDX-License-Identifier: Apache-2.0
#include "tests/client/cli/running_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

// With OpenBLAS loaded, whatever the program is linked with: its thread may take signals.
std::vector<std::string> EnvironmentWith(const std::map<std::string, std::string>& variables) {
  std::map<std::string, std::string> all = variables;
  all.emplace("LD_PRELOAD", dlcs::testing::OpenblasFolder() + "/libopenblas.so.0");
#ifdef __SANITIZE_ADDRESS__
  all.emplace("ASAN_OPTIONS", "verify_asan_link_order=0");  // it defines nothing that the sanitizer does
#endif
  std::vector<std::string> entries;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (all.count(text.substr(0, text.find('='))) == 0) entries.push_back(text);
  }
  for (const auto& [name, value] : all) {
    if (!value.empty()) entries.push_back(name + "=" + value);
  }
  return entries;
}

std::vector<char*> Pointers(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

// Appends what can be read. False at the end.
bool Append(int descriptor, std::string& text) {
  std::array<char, 4096> block;
  const ssize_t count = read(descriptor, block.data(), block.size());
  if (count > 0) text.append(block.data(), static_cast<std::size_t>(count));
  return count > 0;
}

winsize SizeWith(int columns) {
  return {.ws_row = 24, .ws_col = static_cast<unsigned short>(columns), .ws_xpixel = 0, .ws_ypixel = 0};
}

}  // namespace

RunningProgram::RunningProgram(const std::vector<std::string>& arguments, const Settings& settings) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  std::vector<int> passed_on;
  if (settings.columns > 0) {
    output_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    grantpt(output_);
    unlockpt(output_);
    const winsize size = SizeWith(settings.columns);
    const int terminal = open(ptsname(output_), O_RDWR | O_NOCTTY | O_CLOEXEC);
    ioctl(terminal, TIOCSWINSZ, &size);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
      posix_spawn_file_actions_adddup2(&actions, terminal, stream);
    }
    passed_on = {terminal};
  } else {
    std::array<int, 2> output, errors;
    if (pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(errors.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, errors[1], STDERR_FILENO);
    output_ = output[0];
    errors_ = errors[0];
    passed_on = {output[1], errors[1]};
  }
  // Signals as a shell leaves them, whatever the test runner does with them.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t set;
  sigemptyset(&set);
  posix_spawnattr_setsigmask(&attributes, &set);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&set, signal);
  posix_spawnattr_setsigdefault(&attributes, &set);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  std::vector<std::string> words = {dlcs::testing::DlcsProgram()};
  if (settings.ignores_interrupts)
    words = {"/bin/sh", "-c", "trap '' INT; exec \"$@\"", "sh", dlcs::testing::DlcsProgram()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> environment = EnvironmentWith(settings.variables);
  const int error = posix_spawn(&pid_, words.front().c_str(), &actions, &attributes, Pointers(words).data(),
                                Pointers(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  for (const int descriptor : passed_on) close(descriptor);
  if (error != 0) throw std::runtime_error("cannot start " + dlcs::testing::DlcsProgram());
}

RunningProgram::~RunningProgram() {
  if (!ended_) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  for (const int descriptor : {output_, errors_}) {
    if (descriptor >= 0) close(descriptor);
  }
}

bool RunningProgram::Read() {
  std::array<pollfd, 2> ready = {pollfd{output_, POLLIN, 0}, pollfd{errors_, POLLIN, 0}};
  poll(ready.data(), ready.size(), -1);
  bool more = false;
  if (ready[0].revents != 0) more = Append(output_, outcome_.out);
  if (ready[1].revents != 0) more = Append(errors_, outcome_.err) || more;
  // A stream that has ended is not asked any more; the end is that of both.
  if (ready[0].revents != 0 && !more && errors_ >= 0 && ready[1].revents == 0) return Append(errors_, outcome_.err);
  if (ready[1].revents != 0 && !more && ready[0].revents == 0) return Append(output_, outcome_.out);
  return more;
}

void RunningProgram::AwaitErrorText(const std::string& text) {
  const std::string& shown = errors_ >= 0 ? outcome_.err : outcome_.out;
  while (shown.find(text) == std::string::npos) {
    if (!Read()) FAIL() << "ended without \"" << text << "\":\n" << outcome_.out << outcome_.err;
  }
}

bool RunningProgram::HasLoaded(const std::string& library) const {
  std::ifstream maps("/proc/" + std::to_string(pid_) + "/maps");
  const std::string text(std::istreambuf_iterator<char>(maps), {});
  return text.find(library) != std::string::npos;
}

void RunningProgram::Send(const std::vector<int>& signals) {
  kill(pid_, SIGSTOP);
  int status = 0;
  waitpid(pid_, &status, WUNTRACED);
  for (const int signal : signals) kill(pid_, signal);
  kill(pid_, SIGCONT);
}

void RunningProgram::Resize(int columns) const {
  const winsize size = SizeWith(columns);
  ioctl(output_, TIOCSWINSZ, &size);
}

ProgramOutcome RunningProgram::Await() {
  while (Read()) continue;
  int status = 0;
  waitpid(pid_, &status, 0);
  ended_ = true;
  outcome_.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return outcome_;
}

}  // namespace dlcs::client
