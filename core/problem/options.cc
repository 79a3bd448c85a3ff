// SPDX-License-Identifier: Apache-2.0
#include "core/problem/options.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/format_number.h"
#include "core/problem/solution.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

// A grid of a billion nodes is beyond every machine; a mistyped step should not be tried.
constexpr Index kMaxSteps = 1'000'000'000;
// The contour is exact to rounding with a few hundred nodes.
constexpr Index kMaxContourNodes = 10'000;

// More windows in flight would be computed in vain.
constexpr Index kMaxWindowsInFlight = 64;
// Differences of more iterates are dependent to working precision.
constexpr int kMaxAcceleration = 20;

void CheckTimes(const std::vector<double>& times, const std::string& field, double horizon, ViolationList& list) {
  list.AddDisorder(times, field);
  const bool has_horizon = std::isfinite(horizon) && horizon > 0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    if (times[k] < 0 || (has_horizon && times[k] > horizon)) {
      list.Add(field + "[" + std::to_string(k) + "]",
               NumberText(times[k]) + "; must lie in [0, T] = [0, " + NumberText(horizon) + "]");
    }
  }
}

void CheckGrid(const Options& options, double horizon, ViolationList& list) {
  const bool has_horizon = std::isfinite(horizon) && horizon > 0;
  if (options.num_steps < 0 || options.num_steps > kMaxSteps) {
    list.Add("num_steps", std::to_string(options.num_steps) + "; must be between 1 and " + std::to_string(kMaxSteps) +
                              ", or 0 for the default");
  }
  if (!std::isfinite(options.step) || options.step < 0) {
    list.Add("step", NumberText(options.step) + "; must be finite and greater than 0, or 0 for the default");
  } else if (options.step > 0 && has_horizon && horizon / options.step > static_cast<double>(kMaxSteps)) {
    list.Add("step", NumberText(options.step) + "; takes more than " + std::to_string(kMaxSteps) +
                         " steps over T = " + NumberText(horizon));
  }
  if (options.num_steps != 0 && options.step != 0) {
    list.Add("step", NumberText(options.step) + "; only one of step and num_steps may be set, and num_steps is " +
                         std::to_string(options.num_steps));
  }
  if (!options.grid_times.empty() && (options.num_steps != 0 || options.step != 0)) {
    list.Add("grid_times", std::to_string(options.grid_times.size()) +
                               " times; only one of grid_times, step and num_steps may be set");
  }
  constexpr double kMin = Options::kMinErrorTolerance;
  if (options.error_tolerance != 0 && !(options.error_tolerance >= kMin && options.error_tolerance < 1)) {
    list.Add("error_tolerance", NumberText(options.error_tolerance) + "; must be at least " + NumberText(kMin) +
                                    " and below 1, or 0 for none");
  }
  CheckTimes(options.grid_times, "grid_times", horizon, list);
  CheckTimes(options.output_times, "output_times", horizon, list);
}

void CheckPeriodOptions(const Options& options, ViolationList& list) {
  if (options.period == 0) return;
  const bool is_unknown = options.period == Options::kFindPeriod;
  if (!is_unknown && !(options.period > 0 && std::isfinite(options.period))) {
    list.Add("period", NumberText(options.period) +
                           "; must be positive and finite, or -1 to find that of an autonomous oscillation, or 0 for "
                           "a solve from x0");
  }
  if (options.method != Method::kAuto && options.method != Method::kEventDriven) {
    list.Add("method", std::string(MethodName(options.method)) +
                           "; must be event-driven or left open where a periodic solution is asked for");
  }
  if (options.inelastic_impact) {
    list.Add("inelastic_impact",
             "must not be set where a periodic solution is asked for: event-driven knows no impacts");
  }
  const auto refuse_times = [&](const std::vector<double>& times, const char* field) {
    if (!is_unknown || times.empty()) return;
    list.Add(field, std::to_string(times.size()) +
                        " times; must not be set where the period is to be found: ask for a number of steps");
  };
  refuse_times(options.output_times, "output_times");
  refuse_times(options.grid_times, "grid_times");
}

void CheckIteration(const Options& options, ViolationList& list) {
  if (options.window_steps < Options::kWholeHorizon) {
    list.Add("window_steps",
             std::to_string(options.window_steps) + "; must be at least 1, or 0 to adapt, or -1 for the whole horizon");
  }
  if (options.windows_in_flight < 1 || options.windows_in_flight > kMaxWindowsInFlight) {
    list.Add("windows_in_flight", std::to_string(options.windows_in_flight) + "; must be between 1 and " +
                                      std::to_string(kMaxWindowsInFlight));
  }
  if (!(options.iteration_tolerance > 0 && options.iteration_tolerance <= 1)) {
    list.Add("iteration_tolerance", NumberText(options.iteration_tolerance) + "; must lie in (0, 1]");
  }
  if (options.acceleration < 0 || options.acceleration > kMaxAcceleration) {
    list.Add("acceleration",
             std::to_string(options.acceleration) + "; must be between 0 and " + std::to_string(kMaxAcceleration));
  }
  if (options.max_iterations < 0) {
    list.Add("max_iterations", std::to_string(options.max_iterations) + "; must be at least 1, or 0 for the default");
  }
}

void CheckContour(const Options& options, ViolationList& list) {
  if (options.num_contour_nodes < 1 || options.num_contour_nodes > kMaxContourNodes) {
    list.Add("num_contour_nodes",
             std::to_string(options.num_contour_nodes) + "; must be between 1 and " + std::to_string(kMaxContourNodes));
  }
  // Negated, so that NaN breaks the rules too.
  if (!(options.contour_gamma >= 0 && options.contour_gamma < std::numbers::pi / 2)) {
    list.Add("contour_gamma", NumberText(options.contour_gamma) + "; must lie in (0, pi/2), or be 0 for the default");
  }
  const auto check_positive = [&](double value, const char* field) {
    if (!(value >= 0 && std::isfinite(value))) {
      list.Add(field, NumberText(value) + "; must be finite and greater than 0, or 0 for the default");
    }
  };
  check_positive(options.contour_mu, "contour_mu");
  check_positive(options.contour_step, "contour_step");
}

}  // namespace

std::vector<Violation> Validate(const Options& options, double horizon) {
  ViolationList list;
  CheckGrid(options, options.period > 0 ? options.period : horizon, list);
  CheckPeriodOptions(options, list);
  if (!(options.theta >= 0 && options.theta <= 1)) {
    list.Add("theta", NumberText(options.theta) + "; must lie in [0, 1]");
  }
  if (options.average_y && options.theta != 0 && options.theta != 0.5) {
    list.Add("average_y", "averages x and y, which means theta = 0.5, but theta is " + NumberText(options.theta));
  }
  if (options.step_solver == StepSolver::kNewton && options.method != Method::kTimeStepping) {
    list.Add("step_solver", "Newton's method is for the steps of time-stepping; set that method too");
  }
  if (options.average_y && options.method != Method::kTimeStepping) {
    list.Add("average_y", "y is averaged in time-stepping only; set that method too");
  }
  CheckIteration(options, list);
  CheckContour(options, list);
  if (!(options.max_memory > 0)) {
    list.Add("max_memory", NumberText(options.max_memory) + "; must be greater than 0 bytes");
  }
  if (options.num_threads < 0) {
    list.Add("num_threads", std::to_string(options.num_threads) + "; must be at least 1, or 0 for all");
  }
  return std::move(list).Take();
}

}  // namespace dlcs
