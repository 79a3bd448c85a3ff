// SPDX-License-Identifier: Apache-2.0
// Progress at the bottom of a terminal, a line or a few, redrawn several times a second by its own thread.

#ifndef DLCS_CLIENT_CLI_TERMINAL_PROGRESS_TICKER_H_
#define DLCS_CLIENT_CLI_TERMINAL_PROGRESS_TICKER_H_

#include <condition_variable>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace dlcs::client {

// Shows the text that `draw` returns for a width in characters, ten times a second, and first after 0.3 s, so that
// quick work shows nothing; removes it at the end. The width is that of the terminal at that time, or `width` if `out`
// is not a terminal. Lines are cut to the width, and as many are shown as fit into the height. `draw` is called from
// another thread.
//
// The cursor stays visible, so that a crash cannot leave a terminal without one. It waits at the first line of several:
// from there all can be removed, even if the terminal has wrapped them again after a resize.
class Ticker {
 public:
  Ticker(std::FILE* out, int width, std::function<std::string(int)> draw);
  ~Ticker();

  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;

  // Removes what was drawn, runs `print`, which may write whole lines, and draws again below.
  void Above(const std::function<void()>& print);

 private:
  void Run(const std::stop_token& stop);
  void Draw(const std::string& text, int width);
  void Clear();

  std::FILE* out_;
  const int width_;
  const std::function<std::string(int)> draw_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool drawn_ = false;
  std::jthread thread_;  // last: it uses the others
};

// Removes what a Ticker has drawn, for a signal handler that ends the process: async-signal-safe.
void EraseProgressInSignalHandler();

// While it lives, shows `what` and the elapsed seconds on standard error, if that is a terminal.
class WaitView {
 public:
  explicit WaitView(std::string what);

 private:
  std::unique_ptr<Ticker> ticker_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_TERMINAL_PROGRESS_TICKER_H_
