// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/progress_ticker.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "client/cli/output/terminal.h"

namespace dlcs::client {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kFirst{300};
constexpr std::chrono::milliseconds kBetween{100};

}  // namespace

bool CanRedraw(std::FILE* stream) {
  const char* const kind = std::getenv("TERM");
  return isatty(fileno(stream)) != 0 && kind != nullptr && std::string_view(kind) != "dumb";
}

Ticker::Ticker(std::FILE* out, int width, std::function<std::string()> line)
    : out_(out),
      width_(static_cast<std::size_t>(std::max(width - 1, 1))),  // a line that wraps could not be taken back
      line_(std::move(line)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

Ticker::~Ticker() {
  thread_.request_stop();
  thread_.join();
  Clear();
  std::fflush(out_);
}

void Ticker::Run(const std::stop_token& stop) {
  for (auto pause = kFirst; !stop.stop_requested(); pause = kBetween) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, pause, [&] { return stop.stop_requested(); });
    if (stop.stop_requested()) return;
    lock.unlock();
    std::string text = line_();
    text.resize(std::min(text.size(), width_));
    lock.lock();
    fmt::print(out_, "\r\x1b[K{}", text);
    std::fflush(out_);
    drawn_ = true;
  }
}

void Ticker::Above(const std::function<void()>& print) {
  const std::lock_guard lock(mutex_);
  Clear();
  print();
  std::fflush(out_);
}

void Ticker::Clear() {
  if (drawn_) fmt::print(out_, "\r\x1b[K");
  drawn_ = false;
}

WaitView::WaitView(std::string what) {
  if (!CanRedraw(stderr)) return;
  ticker_ = std::make_unique<Ticker>(stderr, WidthOf(stderr), [what = std::move(what), start = steady_clock::now()] {
    return fmt::format("{}, {:.1f} s", what, std::chrono::duration<double>(steady_clock::now() - start).count());
  });
}

}  // namespace dlcs::client
