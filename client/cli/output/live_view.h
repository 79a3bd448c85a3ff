// SPDX-License-Identifier: Apache-2.0
// A solve as it converges, for people at a terminal or reading a log.

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

// Lets a burst of lines through and then so many a second, so that a thousand windows do not bury a log.
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

// Shows what events say. On a terminal: the analysis, rejected windows, and below them a bar that is redrawn, with what
// is being done, for how long, and how long it will take; with `verbose` iterates as well. In a log: the analysis, a
// line per iterate (iteration, change, bound, residual, seconds), rejected windows, and now and then how far it is. A
// solve that iterates faster than people read is condensed to the last iterate of a window, now and then, and the rest
// is counted. To be called from one thread.
class LiveView {
 public:
  struct Settings {
    bool terminal = false;       // redraw a bar
    bool verbose = false;        // on a terminal: iterates too
    int width = 100;             // letters in a line of the terminal
    double horizon = 1;          // T, the end of the bar
    bool warnings = true;        // show those of the analysis; a result that is printed has them too
    bool nonlinear = false;      // then the class is not that of M, and says of what
    bool default_error = false;  // nobody chose a step or an error: say so
    bool estimates = false;      // where steps are given, their error is estimated behind the end
  };

  LiveView(std::FILE* out, const Settings& settings);
  ~LiveView();

  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  void OnEvent(const v1::SolveEvent& event);
  // A line of somebody else's, above the bar.
  void OnText(const std::string& line);
  // What is known up to `time`, of a solve whose windows are not seen.
  void OnReached(double time);
  // Takes the bar away, shows the last iterate and how many were passed over. Later calls do nothing.
  void Finish();

 private:
  void OnAnalysis(const v1::Analysis& analysis);
  void OnIterate(const v1::Iterate& iterate);
  void OnWindowFinished(const v1::WindowFinished& outcome);
  void OnWaiting(const v1::Waiting& waiting);
  void PrintLine(const std::string& line);
  void PrintText(const std::string& text);  // in lines of the width
  void PrintIterate(const v1::Iterate& iterate, const v1::WindowStarted& window);
  void PrintHiddenIterate();
  std::string Bar() const;
  std::string Phase() const;

  std::FILE* out_;
  Settings settings_;
  LineBudget lines_;
  LineBudget signs_of_life_;  // while condensed, or where there is no bar
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  mutable std::mutex mutex_;  // guards all below: the bar is drawn by a thread of its own
  v1::WindowStarted window_;
  v1::Iterate iterate_;              // the last one
  v1::Iterate hidden_iterate_;       // the last one, when it was not shown
  v1::WindowStarted hidden_window_;  // and its window
  double reached_ = 0;               // the time up to which windows were accepted
  std::int64_t passes_ = 1;          // over [0, T]: an estimate of the error takes further ones
  bool analyzed_ = false;
  bool tries_steps_ = false;  // times are those of several solves, and say only how much of the work is done
  bool queued_ = false;
  std::int64_t passed_over_ = 0;
  bool condensed_ = false;
  bool head_printed_ = false;
  bool finished_ = false;
  std::unique_ptr<Ticker> ticker_;  // last: it uses the others
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_LIVE_VIEW_H_
