// SPDX-License-Identifier: Apache-2.0
// Shows the progress of a solve on a terminal or in a log.

#ifndef DLCS_CLIENT_CLI_OUTPUT_LIVE_VIEW_H_
#define DLCS_CLIENT_CLI_OUTPUT_LIVE_VIEW_H_

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>

#include "client/cli/output/progress_ticker.h"
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

// Shows the events of a solve. On a terminal: the analysis, rejected windows, and below them a progress bar with the
// current activity, the elapsed and the remaining time; with `verbose` iterates as well. In a log: the analysis, a line
// per iterate (iteration, change, bound, residual, seconds), rejected windows, and from time to time the progress. If
// iterates come too fast, only the last iterate of some windows is shown, and the others are counted. To be called from
// one thread.
class LiveView {
 public:
  struct Settings {
    bool terminal = false;       // redraw a bar
    bool verbose = false;        // on a terminal: iterates too
    int width = 100;             // characters in a line of the terminal
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
  // Prints another line above the bar.
  void OnText(const std::string& line);
  // Reports that `time` was reached, for a solve whose windows are not reported.
  void OnReached(double time);
  // Removes the bar, and shows the last iterate and how many were not shown. Later calls do nothing.
  void Finish();

 private:
  void OnAnalysis(const v1::Analysis& analysis);
  void OnIterate(const v1::Iterate& iterate);
  void OnWindowFinished(const v1::WindowFinished& outcome);
  void PrintLine(const std::string& line);
  void PrintText(const std::string& text);  // in lines of the width
  void PrintIterate(const v1::Iterate& iterate, const v1::WindowStarted& window);
  void PrintHiddenIterate();
  std::string Bar() const;
  std::string Phase() const;

  std::FILE* out_;
  Settings settings_;
  LineBudget lines_;
  LineBudget signs_of_life_;  // for lines while condensed, or without a bar
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  mutable std::mutex mutex_;  // guards all below: the bar is drawn by a thread of its own
  v1::WindowStarted window_;
  v1::Iterate iterate_;              // the last one
  v1::Iterate hidden_iterate_;       // the last one, when it was not shown
  v1::WindowStarted hidden_window_;  // and its window
  double reached_ = 0;               // the time up to which windows were accepted
  std::int64_t passes_ = 1;          // passes over [0, T]: an error estimate takes further ones
  bool analyzed_ = false;
  bool tries_steps_ = false;  // times are those of several trial solves, and only show the progress
  bool queued_ = false;
  std::int64_t passed_over_ = 0;
  bool condensed_ = false;
  bool head_printed_ = false;
  bool finished_ = false;
  std::unique_ptr<Ticker> ticker_;  // last: it uses the others
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_LIVE_VIEW_H_
