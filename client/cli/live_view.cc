// SPDX-License-Identifier: Apache-2.0
#include "client/cli/live_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/cli/paragraphs.h"
#include "client/cli/words.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

constexpr double kBurst = 60;
// Lines beyond the burst: windows of a condensed view.
constexpr double kLinesPerSecondOnTerminal = 4;
constexpr double kLinesPerSecondInLog = 0.5;
// Lines while one window takes long, or a method that has no iterates.
constexpr double kSignsPerSecondOnTerminal = 1;
constexpr double kSignsPerSecondInLog = 0.2;
constexpr double kBarsPerSecond = 10;
constexpr int kBarLetters = 30;

constexpr const char* kHead = "{:>8}  {:>12}  {:>9}  {:>9}  {:>9}  {:>9}  {:>8}";

std::string Bound(const v1::Iterate& iterate) {
  if (!iterate.has_log10_bound()) return "-";
  return fmt::format("10^{:.1f}", std::round(10 * iterate.log10_bound()) / 10 + 0.0);  // + 0.0: never "-0.0"
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
      signs_of_life_(1, settings.terminal ? kSignsPerSecondOnTerminal : kSignsPerSecondInLog),
      bars_(1, kBarsPerSecond) {
  signs_of_life_.Take(start_);  // the first one is due after a while, not at once
}

LiveView::~LiveView() { Finish(); }

void LiveView::OnEvent(const v1::SolveEvent& event) {
  switch (event.kind_case()) {
    case v1::SolveEvent::kAnalysis:
      OnAnalysis(event.analysis());
      break;
    case v1::SolveEvent::kWindowStarted:
      window_ = event.window_started();
      break;
    case v1::SolveEvent::kIterate:
      OnIterate(event.iterate());
      break;
    case v1::SolveEvent::kWindowFinished:
      OnWindowFinished(event.window_finished());
      break;
    case v1::SolveEvent::kGap:
      passed_over_ += event.gap().iterates();
      break;
    case v1::SolveEvent::kWaiting:
      if (event.waiting().queued()) PrintLine("waits for its turn on the server");
      break;
    case v1::SolveEvent::kAccepted:
    case v1::SolveEvent::kTrajectory:
    case v1::SolveEvent::kSummary:
    case v1::SolveEvent::KIND_NOT_SET:
      break;
  }
  if (settings_.terminal && bars_.Take(LineBudget::Clock::now())) DrawBar();
}

void LiveView::OnAnalysis(const v1::Analysis& analysis) {
  std::string lipschitz;
  if (analysis.has_lipschitz()) lipschitz = fmt::format("; Lipschitz constant {:.3g}", analysis.lipschitz());
  PrintText(fmt::format("{}, {}; {}{}{}", Count(analysis.states(), "state"),
                        Count(analysis.constraints(), "pair"),
                        settings_.nonlinear ? "" : "M: ", analysis.matrix_class(), lipschitz));
  PrintText(fmt::format("method {}: {}", MethodName(analysis.method()), analysis.reason()));
  if (analysis.steps() == 0) {
    PrintLine("steps as short as the error that is allowed needs");
  } else {
    PrintLine(fmt::format("{} of at most {:.4g}{}", Count(analysis.steps(), "step"), analysis.step(),
                          settings_.default_steps ? " (the default; choose with --steps or --step)" : ""));
  }
  if (!settings_.warnings) return;
  for (const std::string& warning : analysis.warnings()) PrintText("warning: " + warning);
}

void LiveView::OnIterate(const v1::Iterate& iterate) {
  const auto now = LineBudget::Clock::now();
  if (!condensed_ && lines_.Take(now)) return PrintIterate(iterate, window_);
  if (!condensed_)
    PrintLine(fmt::format("{:>8}  from here on the last iterate of a window, now and then", "..."));
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
    PrintLine(fmt::format(kHead, "window", "from t", "iteration", "change", "bound", "LCP resid", "seconds"));
    head_printed_ = true;
  }
  const bool known_window = window.window() == iterate.window() && window.steps() > 0;
  PrintLine(fmt::format(kHead, iterate.window(), known_window ? fmt::format("{:.6g}", window.begin()) : "",
                        iterate.iteration(), fmt::format("{:.2e}", iterate.change()), Bound(iterate),
                        fmt::format("{:.1e}", iterate.lcp_residual()),
                        fmt::format("{:.3f}", iterate.seconds())));
}

void LiveView::OnWindowFinished(const v1::WindowFinished& outcome) {
  const auto now = LineBudget::Clock::now();
  if (!outcome.accepted()) {
    if (!lines_.Take(now)) return;
    return PrintLine(fmt::format("{:>8}  not accepted up to t = {:.6g}: {}", outcome.window(), outcome.end(),
                                 outcome.why()));
  }
  reached_ = std::max(reached_, outcome.end());
  if (condensed_ && hidden_iterate_.iteration() > 0) {
    if (lines_.Take(now)) PrintHiddenIterate();
  } else if (!settings_.terminal && outcome.iterations() == 0 && signs_of_life_.Take(now)) {
    PrintLine(fmt::format("t = {:.4g} of {:.4g}", reached_, settings_.horizon));
  }
}

void LiveView::PrintLine(const std::string& line) {
  ClearBar();
  fmt::print(out_, "{}\n", line);
}

void LiveView::PrintText(const std::string& text) {
  ClearBar();
  Paragraphs(settings_.width, out_).Print("", text);
}

void LiveView::DrawBar() {
  const double done = std::clamp(settings_.horizon > 0 ? reached_ / settings_.horizon : 0.0, 0.0, 1.0);
  const int full = static_cast<int>(std::floor(done * kBarLetters));
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start_;
  std::string line = fmt::format("[{}{}] {:3.0f} %  t = {:.4g} of {:.4g}  {:.1f} s", std::string(full, '#'),
                                 std::string(kBarLetters - full, '.'), 100 * done, reached_,
                                 settings_.horizon, seconds.count());
  // A line that wraps could not be taken back.
  line.resize(std::min<std::size_t>(line.size(), static_cast<std::size_t>(std::max(settings_.width - 1, 1))));
  fmt::print(out_, "\r\x1b[K{}", line);
  std::fflush(out_);
  bar_drawn_ = true;
}

void LiveView::ClearBar() {
  if (bar_drawn_) fmt::print(out_, "\r\x1b[K");
  bar_drawn_ = false;
}

void LiveView::Finish() {
  if (finished_) return;
  finished_ = true;
  PrintHiddenIterate();
  if (passed_over_ > 0) PrintLine(fmt::format("{:>8}  {} not shown", "...", Count(passed_over_, "iterate")));
  ClearBar();
  std::fflush(out_);
}

}  // namespace dlcs::client
