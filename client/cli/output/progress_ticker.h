// SPDX-License-Identifier: Apache-2.0
// The last line of a terminal, redrawn several times a second whatever the program is at.

#ifndef DLCS_CLIENT_CLI_OUTPUT_PROGRESS_TICKER_H_
#define DLCS_CLIENT_CLI_OUTPUT_PROGRESS_TICKER_H_

#include <condition_variable>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace dlcs::client {

// Whether lines of the terminal behind `stream` can be redrawn: it is one, and TERM is not "dumb".
bool CanRedraw(std::FILE* stream);

// Shows what `line` returns from a third of a second on, so that what is quick shows nothing, and takes it away at the
// end. It is cut to the terminal's width, `width` letters. `line` is called from another thread.
class Ticker {
 public:
  Ticker(std::FILE* out, int width, std::function<std::string()> line);
  ~Ticker();

  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;

  // Runs `print`, which may write whole lines, where the line was; it is drawn again below.
  void Above(const std::function<void()>& print);

 private:
  void Run(const std::stop_token& stop);
  void Clear();

  std::FILE* out_;
  const std::size_t width_;
  const std::function<std::string()> line_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool drawn_ = false;
  std::jthread thread_;  // last: it uses the others
};

// While it lives: `what` and the seconds so far, on standard error where that is a terminal.
class WaitView {
 public:
  explicit WaitView(std::string what);

 private:
  std::unique_ptr<Ticker> ticker_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_PROGRESS_TICKER_H_
