// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/live_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/cli/terminal/terminal.h"
#include "client/cli/terminal/words.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

constexpr double kBurst = 60;
// Lines beyond the burst: windows of a condensed view.
constexpr double kLinesPerSecondOnTerminal = 4;
constexpr double kLinesPerSecondInLog = 0.5;
// Lines while one window takes long, or for a method without iterates.
constexpr double kProgressLinesPerSecondOnTerminal = 1;
constexpr double kSignsPerSecondInLog = 0.2;

constexpr const char* kRowFormat = "{:>8}  {:>12}  {:>9}  {:>9}  {:>9}  {:>9}  {:>8}";

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
      progress_lines_(1, settings.terminal ? kProgressLinesPerSecondOnTerminal : kSignsPerSecondInLog),
      panel_({.horizon = settings.horizon,
              .estimates = settings.estimates,
              .color = settings.color,
              .utf8 = settings.utf8}) {
  progress_lines_.Take(LineBudget::Clock::now());  // the first one is due after a while, not at once
  if (!settings.terminal) return;
  ticker_ = std::make_unique<Ticker>(out, settings.width, [this](int width) { return panel_.Text(width); });
}

LiveView::~LiveView() { Finish(); }

void LiveView::OnEvent(const v1::SolveEvent& event) {
  panel_.OnEvent(event);
  switch (event.kind_case()) {
    case v1::SolveEvent::kAnalysis:
      return OnAnalysis(event.analysis());
    case v1::SolveEvent::kWindowStarted:
      window_ = event.window_started();
      return;
    case v1::SolveEvent::kIterate:
      return OnIterate(event.iterate());
    case v1::SolveEvent::kWindowFinished:
      return OnWindowFinished(event.window_finished());
    case v1::SolveEvent::kGap:
      passed_over_ += event.gap().iterates();
      return;
    case v1::SolveEvent::kCheckpointed:
      return OnReached(event.checkpointed().time());
    case v1::SolveEvent::kLog:
      return OnText(event.log());
    case v1::SolveEvent::kHeartbeat:
      if (panel_.queued() && !settings_.terminal) PrintLine("waiting in the server's queue");
      return;
    case v1::SolveEvent::kState:
    case v1::SolveEvent::kAccepted:
    case v1::SolveEvent::kTrajectory:
    case v1::SolveEvent::kSummary:
    case v1::SolveEvent::KIND_NOT_SET:
      return;
  }
}

void LiveView::OnText(const std::string& line) { PrintLine(line); }

void LiveView::OnReached(double time) { panel_.OnReached(time); }

void LiveView::OnAnalysis(const v1::Analysis& analysis) {
  std::string lipschitz;
  if (analysis.lipschitz() > 0) lipschitz = fmt::format("; Lipschitz constant {:.3g}", analysis.lipschitz());
  PrintText(fmt::format("{}, {}; {}{}{}", Count(analysis.states(), "state"), Count(analysis.constraints(), "pair"),
                        settings_.nonlinear ? "" : "M: ", analysis.matrix_class(), lipschitz));
  // The reason for the method is in the result.
  const std::string steps =
      analysis.steps() != 0 ? fmt::format("{} of at most {:.4g}", Count(analysis.steps(), "step"), analysis.step())
      : settings_.default_error
          ? "steps for an error of 1e-06 (the default; set it with --tolerance, or steps with --steps)"
          : "steps for the allowed error";
  PrintText(fmt::format("{}, {}", Word(analysis.method()), steps));
  if (!settings_.warnings) return;
  for (const std::string& warning : analysis.warnings()) PrintText("warning: " + warning);
}

void LiveView::OnIterate(const v1::Iterate& iterate) {
  const auto now = LineBudget::Clock::now();
  if (settings_.terminal && !settings_.verbose) return;  // the panel shows it
  if (!condensed_ && lines_.Take(now)) return PrintIterate(iterate, window_);
  if (!condensed_) PrintLine(fmt::format("{:>8}  from here on only the last iterate of some windows", "..."));
  condensed_ = true;
  hidden_iterate_ = iterate;
  hidden_window_ = window_;
  ++passed_over_;
  if (progress_lines_.Take(now)) PrintHiddenIterate();
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
    if ((settings_.terminal && !settings_.verbose) || !lines_.Take(now)) return;
    return PrintLine(
        fmt::format("{:>8}  not accepted up to t = {:.6g}: {}", outcome.window(), outcome.end(), outcome.reason()));
  }
  if (condensed_ && hidden_iterate_.iteration() > 0) {
    if (lines_.Take(now)) PrintHiddenIterate();
  } else if (!settings_.terminal && outcome.iterations() == 0 && progress_lines_.Take(now)) {
    PrintLine(fmt::format("t = {:.4g} of {:.4g}", panel_.reached(), settings_.horizon));
  }
}

void LiveView::PrintLine(const std::string& line) {
  const auto print = [&] { fmt::print(out_, "{}\n", line); };
  ticker_ ? ticker_->Above(print) : print();
}

void LiveView::PrintText(const std::string& text) {
  const auto print = [&] { Paragraphs(WidthOf(out_, settings_.width), out_).Print("", text); };
  ticker_ ? ticker_->Above(print) : print();
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
