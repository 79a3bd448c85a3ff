// SPDX-License-Identifier: Apache-2.0
// A progress line at the bottom of a terminal, redrawn several times a second by its own thread.

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

// Whether `stream` is a terminal whose lines can be redrawn (TERM is not "dumb").
bool CanRedraw(std::FILE* stream);

// Shows the text that `line` returns, after a third of a second, so that quick work shows nothing; removes it at the
// end. The text is cut to `width` characters. `line` is called from another thread.
class Ticker {
 public:
  Ticker(std::FILE* out, int width, std::function<std::string()> line);
  ~Ticker();

  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;

  // Removes the progress line, runs `print`, which may write whole lines, and draws the progress line again below.
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

// While it lives, shows `what` and the elapsed seconds on standard error, if that is a terminal.
class WaitView {
 public:
  explicit WaitView(std::string what);

 private:
  std::unique_ptr<Ticker> ticker_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_PROGRESS_TICKER_H_
