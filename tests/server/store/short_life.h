// SPDX-License-Identifier: Apache-2.0
// A process that is killed.

#ifndef DLCS_TESTS_SERVER_STORE_SHORT_LIFE_H_
#define DLCS_TESTS_SERVER_STORE_SHORT_LIFE_H_

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <random>
#include <string>
#include <thread>

namespace dlcs::jobs::testing {

// For the process that is killed: writes a line as one whole, or ends the process. Lines are below PIPE_BUF.
inline void Say(int pipe, const std::string& line) {
  if (write(pipe, line.data(), line.size()) != static_cast<ssize_t>(line.size())) _exit(1);
}

// Forks; in the child calls `serve`, which never returns, with the end of a pipe; kills the child after `life`. Returns
// what it wrote until then.
inline std::string LiveAndDie(std::chrono::microseconds life, const std::function<void(int pipe)>& serve) {
  int ends[2];
  if (pipe(ends) != 0) return "error no pipe\n";
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    serve(ends[1]);
    _exit(1);
  }
  close(ends[1]);
  // Reads while the process lives, since a full pipe would block it.
  std::string text;
  std::thread reader([&text, end = ends[0]] {
    char buffer[65536];
    for (ssize_t size = 0; (size = read(end, buffer, sizeof buffer)) > 0;)
      text.append(buffer, static_cast<std::size_t>(size));
  });
  std::this_thread::sleep_for(life);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  reader.join();
  close(ends[0]);
  return text;
}

// Processes that live for random times of `least` to `least` + `spread` microseconds, one after the other. All times
// grow if a process wrote nothing: on a slow machine it may have been killed before it began.
class ShortLives {
 public:
  ShortLives(unsigned seed, unsigned least, unsigned spread) : random_(seed), least_(least), spread_(spread) {}

  // As LiveAndDie().
  std::string Next(const std::function<void(int pipe)>& serve) {
    std::string text = LiveAndDie(scale_ * std::chrono::microseconds(least_ + random_() % spread_), serve);
    if (text.empty()) ++scale_;
    return text;
  }

 private:
  std::mt19937 random_;
  unsigned least_, spread_;
  int scale_ = 1;
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_SHORT_LIFE_H_
