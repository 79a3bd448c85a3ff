// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/solve_panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "client/cli/terminal/words.h"
#include "client/cli/terminal/wrapped_text.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kMaxKept = 4096;
constexpr int kMaxBarLetters = 30;
constexpr std::size_t kMaxColumns = 60;
// The time from which on the remaining time is estimated.
constexpr double kSecondsBeforeGuess = 1;
constexpr double kDoneBeforeGuess = 0.02;
constexpr std::chrono::seconds kRateTime{2};
constexpr const char* kChangeColor = "\x1b[36m";  // cyan
constexpr const char* kBoundColor = "\x1b[33m";   // yellow
constexpr const char* kNoColor = "\x1b[0m";

// "12 s", "3 min", "2 h".
std::string Remaining(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", std::ceil(seconds));
  if (seconds < 6000) return fmt::format("{:.0f} min", std::ceil(seconds / 60));
  return fmt::format("{:.0f} h", std::ceil(seconds / 3600));
}

// "0.42", "7.3", "850", "12,000": of two or three digits, since the last ones would flicker.
std::string RoundRate(double rate) {
  if (rate < 10) return fmt::format("{:.2g}", rate);
  const double unit = std::pow(10, std::max(0.0, std::floor(std::log10(rate)) - 1));
  std::string digits = fmt::format("{:.0f}", unit * std::round(rate / unit));
  for (std::size_t at = digits.size(); at > 3;) digits.insert(at -= 3, ",");
  return digits;
}

}  // namespace

void ChangeHistory::Add(const v1::Iterate& iterate) {
  last_ = iterate;
  last_.clear_times();
  last_.clear_y();
  if (added_++ % stride_ != 0) return;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  log10_changes_.push_back(iterate.change() > 0 ? std::log10(iterate.change()) : kNone);
  log10_bounds_.push_back(iterate.has_log10_bound() ? iterate.log10_bound() : kNone);
  has_bound_ = has_bound_ || iterate.has_log10_bound();
  if (log10_changes_.size() < kMaxKept) return;
  stride_ *= 2;
  for (std::vector<double>* values : {&log10_changes_, &log10_bounds_}) {
    for (std::size_t k = 0; k < kMaxKept / 2; ++k) (*values)[k] = (*values)[2 * k];
    values->resize(kMaxKept / 2);
  }
}

std::vector<double> ChangeHistory::Columns(const std::vector<double>& values, std::size_t count) {
  if (values.size() <= count) return values;
  std::vector<double> columns;
  for (std::size_t k = 1; k <= count; ++k) columns.push_back(values[k * values.size() / count - 1]);
  return columns;
}

std::string Sparkline(const std::vector<double>& values, double low, double high, bool utf8) {
  static constexpr std::array<const char*, 8> kBlocks = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  static constexpr std::array<const char*, 8> kLetters = {"_", ".", "-", "=", "+", "*", "%", "#"};
  std::string line;
  for (const double value : values) {
    if (std::isnan(value)) {
      line += ' ';
      continue;
    }
    const double height = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0;
    const auto level = static_cast<std::size_t>(std::lround(7 * height));
    line += utf8 ? kBlocks[level] : kLetters[level];
  }
  return line;
}

double RateMeter::Rate(Clock::time_point now, std::int64_t count) {
  if (now - mark_.time >= kRateTime) {
    before_ = mark_;
    mark_ = {now, count};
  }
  const double seconds = std::chrono::duration<double>(now - before_.time).count();
  return seconds > 0 ? static_cast<double>(count - before_.count) / seconds : 0;
}

void SolvePanel::OnEvent(const v1::SolveEvent& event) {
  const std::lock_guard lock(mutex_);
  switch (event.kind_case()) {
    case v1::SolveEvent::kAnalysis:
      analysis_ = event.analysis();
      analyzed_ = true;
      queued_ = false;
      return;
    case v1::SolveEvent::kWindowStarted:
      windows_[event.window_started().window()] = {.steps = event.window_started().steps(), .history = {}};
      return;
    case v1::SolveEvent::kIterate:
      windows_[event.iterate().window()].history.Add(event.iterate());
      ++iterations_;
      return;
    case v1::SolveEvent::kWindowFinished:
      return OnWindowFinished(event.window_finished());
    case v1::SolveEvent::kGap:
      iterations_ += event.gap().iterates();
      return;
    case v1::SolveEvent::kState:
      queued_ = event.state() == v1::JOB_STATE_QUEUED;
      return;
    default:
      return;
  }
}

void SolvePanel::OnWindowFinished(const v1::WindowFinished& outcome) {
  if (const auto window = windows_.find(outcome.window()); window != windows_.end()) {
    if (outcome.accepted()) steps_ += window->second.steps;
    if (!window->second.history.empty()) Remember(std::move(window->second.history));
    windows_.erase(window);
  }
  if (!outcome.accepted()) {
    ++retries_;
    last_retry_ = outcome;
    return;
  }
  queued_ = false;
  if (outcome.end() < reached_) ++passes_;  // it began again
  reached_ = outcome.end();
}

// `history` becomes that of the last window, and what was that goes to the earlier ones.
void SolvePanel::Remember(ChangeHistory history) {
  const auto append = [](std::vector<double>& earlier, const std::vector<double>& columns) {
    earlier.insert(earlier.end(), columns.begin(), columns.end());
    if (!columns.empty()) earlier.push_back(std::numeric_limits<double>::quiet_NaN());
    if (earlier.size() > kMaxColumns) earlier.erase(earlier.begin(), earlier.end() - kMaxColumns);
  };
  append(earlier_changes_, finished_.Changes(kMaxColumns));
  append(earlier_bounds_, finished_.Bounds(kMaxColumns));
  finished_ = std::move(history);
}

void SolvePanel::OnReached(double time) {
  const std::lock_guard lock(mutex_);
  queued_ = false;
  reached_ = std::max(reached_, time);
}

bool SolvePanel::queued() const {
  const std::lock_guard lock(mutex_);
  return queued_;
}

double SolvePanel::reached() const {
  const std::lock_guard lock(mutex_);
  return reached_;
}

// Of several windows in flight the first: the others begin from values that it still changes.
const ChangeHistory* SolvePanel::Shown() const {
  for (const auto& [number, window] : windows_) {
    if (!window.history.empty()) return &window.history;
  }
  return finished_.empty() ? nullptr : &finished_;
}

std::string SolvePanel::Text(int width) {
  const std::lock_guard lock(mutex_);
  const auto now = RateMeter::Clock::now();
  const auto letters = static_cast<std::size_t>(std::max(width, 1));
  std::string text = BarLine(letters, std::chrono::duration<double>(now - start_).count());
  text += FactLines(letters, now);
  if (retries_ > 0) text += '\n' + FirstLetters(RetryLine(), letters);
  return text + ChangeLines(letters);
}

std::string SolvePanel::BarLine(std::size_t width, double seconds) {
  // Times of trial solves with shorter and shorter steps only show the progress.
  const bool tries_steps = analyzed_ && analysis_.steps() == 0 && analysis_.method() != v1::METHOD_EVENT_DRIVEN;
  const double done = std::clamp(settings_.horizon > 0 ? reached_ / settings_.horizon : 0.0, 0.0, 1.0);
  constexpr int kBeside = 34;  // "[]  50 %  123.4 s, about 12 min left"
  const int letters = std::clamp(static_cast<int>(width) - kBeside, 6, kMaxBarLetters);
  const int full = static_cast<int>(std::floor(done * letters));
  // All of it is done where nothing is left to do: 99.9 % are 99.
  std::string line = fmt::format("[{}{}] {:3.0f} %  {:.1f} s", std::string(full, '#'), std::string(letters - full, '.'),
                                 std::floor(100 * done), seconds);
  // Earlier events of a job that is watched late arrive at once; only later ones take time.
  if (first_seconds_ < 0) first_seconds_ = seconds, first_done_ = done;
  const double watched = seconds - first_seconds_, progress = done - first_done_;
  if (watched > kSecondsBeforeGuess && progress > kDoneBeforeGuess && done < 1 && passes_ == 1 && !tries_steps) {
    line += fmt::format(", about {} left", Remaining(watched * (1 - done) / progress));
  }
  return FirstLetters(line, width);
}

// The current activity, if the time does not show it.
std::string SolvePanel::Phase() const {
  if (queued_) return "waiting in the server's queue";
  const auto window_text = [this](std::int32_t number, const ChangeHistory& history) {
    const std::string others = windows_.size() > 1 ? fmt::format(" and {} more", windows_.size() - 1) : "";
    return fmt::format("window {}{}, iteration {}", number, others, history.last().iteration());
  };
  if (!windows_.empty() && !windows_.begin()->second.history.empty()) {
    return window_text(windows_.begin()->first, windows_.begin()->second.history);
  }
  const bool tries_steps = analysis_.steps() == 0 && analysis_.method() != v1::METHOD_EVENT_DRIVEN;
  if (analyzed_ && tries_steps && reached_ > 0) return "trying shorter steps";
  if (reached_ >= settings_.horizon) return settings_.estimates ? "estimating the error" : "checking the result";
  // Between two windows the one before, so that the line does not flicker.
  if (reached_ > 0 && !finished_.empty()) return window_text(finished_.last().window(), finished_);
  if (reached_ > 0) return passes_ > 1 ? fmt::format("pass {}", passes_) : "";
  return analyzed_ ? "setting up" : "analyzing";
}

// Each fact is put on the line if there is room, otherwise on the next one.
std::string SolvePanel::FactLines(std::size_t width, RateMeter::Clock::time_point now) {
  const bool tries_steps = analyzed_ && analysis_.steps() == 0 && analysis_.method() != v1::METHOD_EVENT_DRIVEN;
  std::vector<std::string> facts;
  if (!tries_steps) facts.push_back(fmt::format("t = {:.4g} of {:.4g}", reached_, settings_.horizon));
  if (const std::string phase = Phase(); !phase.empty()) facts.push_back(phase);
  const double iterations = iteration_rate_.Rate(now, iterations_), steps = step_rate_.Rate(now, steps_);
  if (iterations > 0) {
    facts.push_back(RoundRate(iterations) + " iterations/s");
  } else if (steps > 0) {
    facts.push_back(RoundRate(steps) + " steps/s");
  }
  std::string text;
  std::size_t letters = width;  // of the last line, which is the bar's
  for (const std::string& fact : facts) {
    const std::string cut = FirstLetters(fact, width);
    const bool fits = letters + 2 + LetterCount(cut) <= width;
    text += (fits ? "  " : "\n") + cut;
    letters = LetterCount(cut) + (fits ? letters + 2 : 0);
  }
  return text;
}

std::string SolvePanel::RetryLine() const {
  return fmt::format("{} tried again; the last, up to t = {:.4g}: {}", Count(retries_, "window"), last_retry_.end(),
                     last_retry_.reason());
}

std::string SolvePanel::ChangeLines(std::size_t width) const {
  const ChangeHistory* const history = Shown();
  if (history == nullptr) return "";
  constexpr std::size_t kLabel = 8, kValue = 10;  // "change  " and "  1.23e-45"
  if (width < kLabel + kValue + 1) return "";
  const std::size_t columns = std::min(width - kLabel - kValue, kMaxColumns);
  std::vector<double> changes = history->Changes(columns), bounds = history->Bounds(columns);
  const auto prepend = [columns](std::vector<double>& values, std::vector<double> earlier,
                                 const std::vector<double>& last) {
    if (!last.empty()) {
      earlier.insert(earlier.end(), last.begin(), last.end());
      earlier.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    const std::size_t room = std::min(columns - values.size(), earlier.size());
    values.insert(values.begin(), earlier.end() - static_cast<std::ptrdiff_t>(room), earlier.end());
  };
  const bool is_finished = history == &finished_;
  prepend(changes, earlier_changes_, is_finished ? std::vector<double>() : finished_.Changes(columns));
  prepend(bounds, earlier_bounds_, is_finished ? std::vector<double>() : finished_.Bounds(columns));
  double low = std::numeric_limits<double>::infinity(), high = -low, highest = -low;
  for (const double value : changes) {
    if (!std::isnan(value)) low = std::min(low, value), high = std::max(high, value);
  }
  for (const double value : bounds) {
    if (!std::isnan(value)) highest = std::max(highest, value);
  }
  // One scale for both. Bounds far above the changes are cut off, or the changes would be a flat line; and less than
  // three decades are not stretched, or a change that stays the same would look like convergence.
  constexpr double kMinDecades = 3;
  const double decades = std::max(high - low, kMinDecades);
  low = std::min(low, high - kMinDecades);
  if (highest > high) high = std::min(highest, high + decades);
  const auto line = [&](const char* label, const std::vector<double>& values, const std::string& last,
                        const char* color) {
    return fmt::format("\n{:<8}{}{}{}  {}", label, settings_.color ? color : "",
                       Sparkline(values, low, high, settings_.utf8), settings_.color ? kNoColor : "", last);
  };
  std::string text = line("change", changes, fmt::format("{:.2g}", history->last().change()), kChangeColor);
  if (history->has_bound()) {
    const double bound = history->last().log10_bound();
    text += line("bound", bounds, fmt::format("10^{:.1f}", std::round(10 * bound) / 10 + 0.0), kBoundColor);
  }
  return text;
}

}  // namespace dlcs::client
