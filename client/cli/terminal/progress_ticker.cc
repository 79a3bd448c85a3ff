// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/progress_ticker.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <sstream>
#include <string_view>
#include <utility>

#include "client/cli/terminal/terminal.h"
#include "client/cli/terminal/wrapped_text.h"

namespace dlcs::client {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kFirst{300};
constexpr std::chrono::milliseconds kBetween{100};
// Back to the first column; removes all from there to the end of the screen.
constexpr std::string_view kErase = "\r\x1b[J";

// Where something is drawn; -1 if nothing is.
std::atomic<int> drawn_on{-1};

}  // namespace

Ticker::Ticker(std::FILE* out, int width, std::function<std::string(int)> draw)
    : out_(out), width_(width), draw_(std::move(draw)), thread_([this](const std::stop_token& stop) { Run(stop); }) {}

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
    // One column stays free: some terminals continue a full line on the next one.
    const int width = std::max(WidthOf(out_, width_) - 1, 1);
    const std::string text = draw_(width);
    lock.lock();
    Draw(text, width);
  }
}

void Ticker::Draw(const std::string& text, int width) {
  const int most = std::max(HeightOf(out_) - 1, 1);  // lines that have left the screen cannot be removed
  std::istringstream in(text);
  std::string written;
  int lines = 0;
  for (std::string line; lines < most && std::getline(in, line); ++lines) {
    written += (lines == 0 ? "\r" : "\n") + FirstLetters(line, static_cast<std::size_t>(width)) + "\x1b[K";
  }
  written += "\x1b[J";
  if (lines > 1) written += fmt::format("\r\x1b[{}A", lines - 1);
  // Before the drawing: erasing what is not there does no harm.
  drawn_ = true;
  drawn_on = fileno(out_);
  fmt::print(out_, "{}", written);
  std::fflush(out_);
}

void Ticker::Above(const std::function<void()>& print) {
  const std::lock_guard lock(mutex_);
  Clear();
  print();
  std::fflush(out_);
}

void Ticker::Clear() {
  if (drawn_) fmt::print(out_, "{}", kErase);
  drawn_ = false;
  drawn_on = -1;
}

void EraseProgressInSignalHandler() {
  const int descriptor = drawn_on.load();
  if (descriptor < 0) return;
  [[maybe_unused]] const ssize_t written = write(descriptor, kErase.data(), kErase.size());
}

WaitView::WaitView(std::string what) {
  if (!CanRedraw(stderr)) return;
  ticker_ =
      std::make_unique<Ticker>(stderr, WidthOf(stderr), [what = std::move(what), start = steady_clock::now()](int) {
        return fmt::format("{}, {:.1f} s", what, std::chrono::duration<double>(steady_clock::now() - start).count());
      });
}

}  // namespace dlcs::client
