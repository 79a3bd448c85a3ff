// SPDX-License-Identifier: Apache-2.0
// A solve as it converges, for people at a terminal or reading a log.

#ifndef DLCS_CLIENT_CLI_LIVE_VIEW_H_
#define DLCS_CLIENT_CLI_LIVE_VIEW_H_

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>

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

// Writes what events tell: the analysis, a line per iterate (iteration, change, bound, residual, seconds),
// rejected windows, and, on a terminal, a progress bar below them. A solve that iterates faster than people
// read is condensed to the last iterate of a window, now and then, and the rest is counted. Not thread-safe.
class LiveView {
 public:
  struct Settings {
    bool terminal = false;       // redraw a progress bar
    int width = 100;             // letters in a line of the terminal
    double horizon = 1;          // T, the end of the bar
    bool warnings = true;        // show those of the analysis; a result that is printed has them too
    bool nonlinear = false;      // then the class is not that of M, and says of what
    bool default_steps = false;  // nobody chose the step: say so
  };

  LiveView(std::FILE* out, const Settings& settings);
  ~LiveView();

  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  void OnEvent(const v1::SolveEvent& event);
  // Takes the bar away, shows the last iterate and how many were passed over. Later calls do nothing.
  void Finish();

 private:
  void OnAnalysis(const v1::Analysis& analysis);
  void OnIterate(const v1::Iterate& iterate);
  void OnWindowFinished(const v1::WindowFinished& outcome);
  void PrintLine(const std::string& line);
  void PrintText(const std::string& text);  // in lines of the width
  void PrintIterate(const v1::Iterate& iterate, const v1::WindowStarted& window);
  void PrintHiddenIterate();
  void DrawBar();
  void ClearBar();

  std::FILE* out_;
  Settings settings_;
  LineBudget lines_;
  LineBudget signs_of_life_;  // while condensed, or where there is no bar
  LineBudget bars_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  v1::WindowStarted window_;
  v1::Iterate hidden_iterate_;       // the last one, when it was not shown
  v1::WindowStarted hidden_window_;  // and its window
  double reached_ = 0;               // the time up to which windows were accepted
  std::int64_t passed_over_ = 0;
  bool condensed_ = false;
  bool head_printed_ = false;
  bool bar_drawn_ = false;
  bool finished_ = false;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_LIVE_VIEW_H_
