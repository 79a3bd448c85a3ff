// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/live_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/cli/output/words.h"
#include "client/cli/output/wrapped_text.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

constexpr double kBurst = 60;
// Lines beyond the burst: windows of a condensed view.
constexpr double kLinesPerSecondOnTerminal = 4;
constexpr double kLinesPerSecondInLog = 0.5;
// Lines while one window takes long, or for a method without iterates.
constexpr double kSignsPerSecondOnTerminal = 1;
constexpr double kSignsPerSecondInLog = 0.2;
constexpr int kBarLetters = 30;
// The time from which on the remaining time is estimated.
constexpr double kSecondsBeforeGuess = 1;
constexpr double kDoneBeforeGuess = 0.02;

constexpr const char* kRowFormat = "{:>8}  {:>12}  {:>9}  {:>9}  {:>9}  {:>9}  {:>8}";

std::string Bound(const v1::Iterate& iterate) {
  if (!iterate.has_log10_bound()) return "-";
  return fmt::format("10^{:.1f}", std::round(10 * iterate.log10_bound()) / 10 + 0.0);  // + 0.0: never "-0.0"
}

// "12 s", "3 min", "2 h".
std::string Duration(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", std::ceil(seconds));
  if (seconds < 6000) return fmt::format("{:.0f} min", std::ceil(seconds / 60));
  return fmt::format("{:.0f} h", std::ceil(seconds / 3600));
}

}  // namespace

bool LineBudget::Take(Clock::time_point now) {
  if (last_ != Clock::time_point{}) {
    left_ = std::min(burst_, left_ + per_second_ * std::chrono::duration<double>(now - last_).count());
  }
  last_ = now;
  if (left_ < 1) return false;
  left_ -= 1;
  return true;
}

LiveView::LiveView(std::FILE* out, const Settings& settings)
    : out_(out),
      settings_(settings),
      lines_(kBurst, settings.terminal ? kLinesPerSecondOnTerminal : kLinesPerSecondInLog),
      signs_of_life_(1, settings.terminal ? kSignsPerSecondOnTerminal : kSignsPerSecondInLog) {
  signs_of_life_.Take(start_);  // the first one is due after a while, not at once
  if (settings.terminal) ticker_ = std::make_unique<Ticker>(out, settings.width, [this] { return Bar(); });
}

LiveView::~LiveView() { Finish(); }

void LiveView::OnEvent(const v1::SolveEvent& event) {
  switch (event.kind_case()) {
    case v1::SolveEvent::kAnalysis:
      return OnAnalysis(event.analysis());
    case v1::SolveEvent::kWindowStarted: {
      const std::lock_guard lock(mutex_);
      window_ = event.window_started();
      return;
    }
    case v1::SolveEvent::kIterate:
      return OnIterate(event.iterate());
    case v1::SolveEvent::kWindowFinished:
      return OnWindowFinished(event.window_finished());
    case v1::SolveEvent::kGap:
      passed_over_ += event.gap().iterates();
      return;
    case v1::SolveEvent::kState: {
      const std::lock_guard lock(mutex_);
      queued_ = event.state() == v1::JOB_STATE_QUEUED;
      return;
    }
    case v1::SolveEvent::kCheckpointed:
      return OnReached(event.checkpointed().time());
    case v1::SolveEvent::kLog:
      return OnText(event.log());
    case v1::SolveEvent::kHeartbeat:
      if (queued_ && !settings_.terminal) PrintLine("waiting in the server's queue");  // a terminal has the bar
      return;
    case v1::SolveEvent::kAccepted:
    case v1::SolveEvent::kTrajectory:
    case v1::SolveEvent::kSummary:
    case v1::SolveEvent::KIND_NOT_SET:
      return;
  }
}

void LiveView::OnText(const std::string& line) { PrintLine(line); }

void LiveView::OnReached(double time) {
  const std::lock_guard lock(mutex_);
  queued_ = false;
  reached_ = std::max(reached_, time);
}

void LiveView::OnAnalysis(const v1::Analysis& analysis) {
  {
    const std::lock_guard lock(mutex_);
    analyzed_ = true;
    tries_steps_ = analysis.steps() == 0 && analysis.method() != v1::METHOD_EVENT_DRIVEN;
    queued_ = false;
  }
  std::string lipschitz;
  if (analysis.has_lipschitz()) lipschitz = fmt::format("; Lipschitz constant {:.3g}", analysis.lipschitz());
  PrintText(fmt::format("{}, {}; {}{}{}", Count(analysis.states(), "state"), Count(analysis.constraints(), "pair"),
                        settings_.nonlinear ? "" : "M: ", analysis.matrix_class(), lipschitz));
  PrintText(fmt::format("method {}: {}", Word(analysis.method()), analysis.reason()));
  if (analysis.steps() == 0) {
    PrintLine(settings_.default_error
                  ? "steps chosen for an error of 1e-06 (the default; set it with --tolerance, or steps with --steps)"
                  : "steps chosen for the allowed error");
  } else {
    PrintLine(fmt::format("{} of at most {:.4g}", Count(analysis.steps(), "step"), analysis.step()));
  }
  if (!settings_.warnings) return;
  for (const std::string& warning : analysis.warnings()) PrintText("warning: " + warning);
}

void LiveView::OnIterate(const v1::Iterate& iterate) {
  const auto now = LineBudget::Clock::now();
  {
    const std::lock_guard lock(mutex_);
    iterate_ = iterate;
  }
  if (settings_.terminal && !settings_.verbose) return;  // the bar says so
  if (!condensed_ && lines_.Take(now)) return PrintIterate(iterate, window_);
  if (!condensed_) PrintLine(fmt::format("{:>8}  from here on only the last iterate of some windows", "..."));
  condensed_ = true;
  hidden_iterate_ = iterate;
  hidden_window_ = window_;
  ++passed_over_;
  if (signs_of_life_.Take(now)) PrintHiddenIterate();
}

void LiveView::PrintHiddenIterate() {
  if (hidden_iterate_.iteration() == 0) return;
  --passed_over_;
  PrintIterate(hidden_iterate_, hidden_window_);
  hidden_iterate_.Clear();
}

void LiveView::PrintIterate(const v1::Iterate& iterate, const v1::WindowStarted& window) {
  if (!head_printed_) {
    PrintLine(fmt::format(kRowFormat, "window", "from t", "iteration", "change", "bound", "LCP resid", "seconds"));
    head_printed_ = true;
  }
  const bool known_window = window.window() == iterate.window() && window.steps() > 0;
  PrintLine(fmt::format(kRowFormat, iterate.window(), known_window ? fmt::format("{:.6g}", window.begin()) : "",
                        iterate.iteration(), fmt::format("{:.2e}", iterate.change()), Bound(iterate),
                        fmt::format("{:.1e}", iterate.lcp_residual()), fmt::format("{:.3f}", iterate.seconds())));
}

void LiveView::OnWindowFinished(const v1::WindowFinished& outcome) {
  const auto now = LineBudget::Clock::now();
  if (!outcome.accepted()) {
    if (!lines_.Take(now)) return;
    return PrintLine(
        fmt::format("{:>8}  not accepted up to t = {:.6g}: {}", outcome.window(), outcome.end(), outcome.reason()));
  }
  {
    const std::lock_guard lock(mutex_);
    queued_ = false;
    if (outcome.end() < reached_) ++passes_;  // it began once more
    reached_ = outcome.end();
    iterate_.Clear();
  }
  if (condensed_ && hidden_iterate_.iteration() > 0) {
    if (lines_.Take(now)) PrintHiddenIterate();
  } else if (!settings_.terminal && outcome.iterations() == 0 && signs_of_life_.Take(now)) {
    PrintLine(fmt::format("t = {:.4g} of {:.4g}", reached_, settings_.horizon));
  }
}

void LiveView::PrintLine(const std::string& line) {
  const auto print = [&] { fmt::print(out_, "{}\n", line); };
  ticker_ ? ticker_->Above(print) : print();
}

void LiveView::PrintText(const std::string& text) {
  const auto print = [&] { Paragraphs(settings_.width, out_).Print("", text); };
  ticker_ ? ticker_->Above(print) : print();
}

// The current activity, if the time does not show it.
std::string LiveView::Phase() const {
  if (queued_) return "waiting in the server's queue";
  if (iterate_.iteration() > 0) {
    return fmt::format("window {}, iteration {}, change {:.0e}", iterate_.window(), iterate_.iteration(),
                       iterate_.change());
  }
  if (tries_steps_ && reached_ > 0) return "trying shorter steps";
  if (reached_ >= settings_.horizon) return settings_.estimates ? "estimating the error" : "checking the result";
  if (reached_ > 0) return passes_ > 1 ? fmt::format("pass {}", passes_) : "";
  return analyzed_ ? "setting up" : "analyzing";
}

std::string LiveView::Bar() const {
  const std::lock_guard lock(mutex_);
  const double done = std::clamp(settings_.horizon > 0 ? reached_ / settings_.horizon : 0.0, 0.0, 1.0);
  const int full = static_cast<int>(std::floor(done * kBarLetters));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  // All of it is done where nothing is left to do: 99.9 % are 99.
  std::string line = fmt::format("[{}{}] {:3.0f} %", std::string(full, '#'), std::string(kBarLetters - full, '.'),
                                 std::floor(100 * done));
  if (!tries_steps_) line += fmt::format("  t = {:.4g} of {:.4g}", reached_, settings_.horizon);
  line += fmt::format("  {:.1f} s", seconds);
  if (seconds > kSecondsBeforeGuess && done > kDoneBeforeGuess && done < 1 && passes_ == 1 && !tries_steps_) {
    line += fmt::format(", about {} left", Duration(seconds * (1 - done) / done));
  }
  if (const std::string phase = Phase(); !phase.empty()) line += "  " + phase;
  return line;
}

void LiveView::Finish() {
  if (finished_) return;
  finished_ = true;
  PrintHiddenIterate();
  if (passed_over_ > 0) PrintLine(fmt::format("{:>8}  {} not shown", "...", Count(passed_over_, "iterate")));
  ticker_.reset();
  std::fflush(out_);
}

}  // namespace dlcs::client
