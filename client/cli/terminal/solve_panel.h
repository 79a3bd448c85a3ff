// SPDX-License-Identifier: Apache-2.0
// The display of a running solve on a terminal: a few lines, made for each drawing.

#ifndef DLCS_CLIENT_CLI_TERMINAL_SOLVE_PANEL_H_
#define DLCS_CLIENT_CLI_TERMINAL_SOLVE_PANEL_H_

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// The changes of the iterates of one window, and their bounds. Keeps at most some thousands; of more, every second,
// fourth, ... one.
class ChangeHistory {
 public:
  void Add(const v1::Iterate& iterate);
  bool empty() const { return log10_changes_.empty(); }
  const v1::Iterate& last() const { return last_; }
  bool has_bound() const { return has_bound_; }

  // Common logarithms for `count` columns or fewer, over all iterations so far. NaN if there is none.
  std::vector<double> Changes(std::size_t count) const { return Columns(log10_changes_, count); }
  std::vector<double> Bounds(std::size_t count) const { return Columns(log10_bounds_, count); }

 private:
  static std::vector<double> Columns(const std::vector<double>& values, std::size_t count);

  std::vector<double> log10_changes_;
  std::vector<double> log10_bounds_;
  v1::Iterate last_;
  bool has_bound_ = false;
  std::int64_t stride_ = 1;  // between the iterations that are kept
  std::int64_t added_ = 0;
};

// `values` as one character each, with eight heights from `low` to `high`; letters of ASCII without `utf8`.
std::string Sparkline(const std::vector<double>& values, double low, double high, bool utf8);

// How often something happened per second, over the last seconds.
class RateMeter {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateMeter(Clock::time_point start) : mark_{start, 0}, before_{start, 0} {}
  double Rate(Clock::time_point now, std::int64_t count);

 private:
  struct Mark {
    Clock::time_point time;
    std::int64_t count;
  };
  Mark mark_;
  Mark before_;
};

// The lines: a bar with the elapsed and the remaining time; the time of the problem, the current activity and the rate;
// the windows that were tried again; the changes of the window that is farthest back, and their a priori bounds, on one
// logarithmic scale, after those of windows before as far as there is room. Events come from one thread, Text() may be
// called from another.
class SolvePanel {
 public:
  struct Settings {
    double horizon = 1;      // T, the end of the bar
    bool estimates = false;  // steps are given, and their error is estimated after the end
    bool color = false;
    bool utf8 = false;
  };

  explicit SolvePanel(const Settings& settings) : settings_(settings) {}

  void OnEvent(const v1::SolveEvent& event);
  // `time` was reached, in a solve whose windows are not reported.
  void OnReached(double time);

  bool queued() const;
  // The time up to which windows were accepted.
  double reached() const;

  // Lines of at most `width` characters.
  std::string Text(int width);

 private:
  struct Window {
    std::int32_t steps = 0;
    ChangeHistory history;
  };

  void OnWindowFinished(const v1::WindowFinished& outcome);
  void Remember(ChangeHistory history);
  const ChangeHistory* Shown() const;
  std::string Phase() const;
  std::string BarLine(std::size_t width, double seconds);
  std::string FactLines(std::size_t width, RateMeter::Clock::time_point now);
  std::string RetryLine() const;
  std::string ChangeLines(std::size_t width) const;

  const Settings settings_;
  const RateMeter::Clock::time_point start_ = RateMeter::Clock::now();
  mutable std::mutex mutex_;                // guards all below
  std::map<std::int32_t, Window> windows_;  // that are being solved
  ChangeHistory finished_;                  // of the last window that was
  std::vector<double> earlier_changes_;     // of windows that were solved before, NaN between them
  std::vector<double> earlier_bounds_;
  v1::Analysis analysis_;
  bool analyzed_ = false;
  bool queued_ = false;
  double reached_ = 0;
  double first_seconds_ = -1;  // of the first drawing, and the part that was done then
  double first_done_ = 0;
  std::int64_t passes_ = 1;  // passes over [0, T]: an error estimate takes further ones
  std::int64_t steps_ = 0;   // accepted
  std::int64_t iterations_ = 0;
  std::int64_t retries_ = 0;
  v1::WindowFinished last_retry_;
  RateMeter step_rate_{start_};
  RateMeter iteration_rate_{start_};
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_TERMINAL_SOLVE_PANEL_H_
