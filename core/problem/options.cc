// SPDX-License-Identifier: Apache-2.0
#include "core/problem/options.h"

#include <cmath>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/format_number.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

void CheckRange(const Options& options, const OptionRange& range, ViolationList& list) {
  static const Options defaults;
  std::visit(
      [&](const auto member) {
        const auto value = options.*member;
        const auto number = static_cast<double>(value);
        // A NaN is neither.
        if (value == defaults.*member || (number >= range.least && number <= range.most)) return;
        std::string text;
        if constexpr (std::is_floating_point_v<std::remove_const_t<decltype(value)>>) {
          text = NumberText(value);
        } else {
          text = std::to_string(value);
        }
        const std::string otherwise = range.otherwise ? std::string(", or ") + range.otherwise : "";
        list.Add(range.field, text + "; must be " + range.words + otherwise);
      },
      range.value);
}

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
  if (options.step > 0 && has_horizon && horizon / options.step > static_cast<double>(Options::kMaxSteps)) {
    list.Add("step", NumberText(options.step) + "; takes more than " + std::to_string(Options::kMaxSteps) +
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

}  // namespace

const char* MethodName(Method method) {
  switch (method) {
    case Method::kAuto:
      return "auto";
    case Method::kLaplaceIteration:
      return "laplace-iteration";
    case Method::kWuChenIteration:
      return "wu-chen-iteration";
    case Method::kExponentialIntegrator:
      return "exponential-integrator";
    case Method::kEventDriven:
      return "event-driven";
    case Method::kTimeStepping:
      return "time-stepping";
  }
  return "unknown";
}

std::string MemoryLimitText(const Options& options) {
  return "the " + FormatNumber(options.max_memory) + " allowed (--max-memory, or the limit of the server)";
}

std::vector<Violation> Validate(const Options& options, double horizon) {
  ViolationList list;
  for (const OptionRange& range : kOptionRanges) CheckRange(options, range, list);
  CheckGrid(options, options.period > 0 ? options.period : horizon, list);
  CheckPeriodOptions(options, list);
  const auto check_absolute = [&](double tolerance, const std::string& field) {
    if (tolerance >= 0 && std::isfinite(tolerance)) return;
    list.Add(field, NumberText(tolerance) + "; must be finite and at least 0");
  };
  if (options.absolute_tolerance) check_absolute(*options.absolute_tolerance, "absolute_tolerance");
  for (std::size_t k = 0; k < options.absolute_tolerances.size(); ++k) {
    check_absolute(options.absolute_tolerances[k].tolerance,
                   "absolute_tolerances[" + std::to_string(k) + "].tolerance");
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
  return std::move(list).Take();
}

}  // namespace dlcs
