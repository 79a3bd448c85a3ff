// SPDX-License-Identifier: Apache-2.0
// Shows the progress of a solve on a terminal or in a log.

#ifndef DLCS_CLIENT_CLI_TERMINAL_LIVE_VIEW_H_
#define DLCS_CLIENT_CLI_TERMINAL_LIVE_VIEW_H_

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "client/cli/terminal/progress_ticker.h"
#include "client/cli/terminal/solve_panel.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Limits the rate of lines: a burst, and then so many per second, so that a thousand windows do not fill a log.
class LineBudget {
 public:
  using Clock = std::chrono::steady_clock;

  LineBudget(double burst, double per_second) : burst_(burst), per_second_(per_second), left_(burst) {}
  bool Take(Clock::time_point now);

 private:
  double burst_;
  double per_second_;
  double left_;
  Clock::time_point last_{};
};

// Shows the events of a solve. On a terminal: the analysis, and below it a panel (solve_panel.h); with `verbose` also a
// line for each iterate and rejected window. In a log: the analysis, a line per iterate (iteration, change, bound,
// residual, seconds), rejected windows, and from time to time the progress. If iterates arrive too fast, only the last
// iterate of some windows is shown, and the others are counted. To be called from one thread.
class LiveView {
 public:
  struct Settings {
    bool terminal = false;       // draw a panel
    bool color = false;          // with colors
    bool utf8 = false;           // with other letters than those of ASCII
    bool verbose = false;        // on a terminal: iterates too
    int width = 100;             // characters in a line, if that of the terminal is not known
    double horizon = 1;          // T, the end of the bar
    bool warnings = true;        // show the warnings of the analysis (a printed result has them too)
    bool nonlinear = false;      // the class is that of the Jacobian of g, not of M
    bool default_error = false;  // neither a step nor an error was given: say so
    bool estimates = false;      // steps are given, and their error is estimated after the end
  };

  LiveView(std::FILE* out, const Settings& settings);
  ~LiveView();

  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  void OnEvent(const v1::SolveEvent& event);
  // Prints another line above the panel.
  void OnText(const std::string& line);
  // Reports that `time` was reached, for a solve whose windows are not reported.
  void OnReached(double time);
  // Removes the panel, and shows the last iterate and how many were not shown. Later calls do nothing.
  void Finish();

 private:
  void OnAnalysis(const v1::Analysis& analysis);
  void OnIterate(const v1::Iterate& iterate);
  void OnWindowFinished(const v1::WindowFinished& outcome);
  void PrintLine(const std::string& line);
  void PrintText(const std::string& text);  // in lines of the width
  void PrintIterate(const v1::Iterate& iterate, const v1::WindowStarted& window);
  void PrintHiddenIterate();

  std::FILE* out_;
  Settings settings_;
  LineBudget lines_;
  LineBudget progress_lines_;  // for lines while condensed, or without a panel
  SolvePanel panel_;
  v1::WindowStarted window_;
  v1::Iterate hidden_iterate_;       // the last one, when it was not shown
  v1::WindowStarted hidden_window_;  // and its window
  std::int64_t passed_over_ = 0;
  bool condensed_ = false;
  bool head_printed_ = false;
  bool finished_ = false;
  std::unique_ptr<Ticker> ticker_;  // last: it uses the others
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_TERMINAL_LIVE_VIEW_H_
