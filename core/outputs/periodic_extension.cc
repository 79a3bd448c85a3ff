// SPDX-License-Identifier: Apache-2.0
#include "core/outputs/periodic_extension.h"

#include <algorithm>
#include <cmath>

#include "core/format_number.h"

namespace dlcs {

PhasedTime PeriodicExtension::PhaseOf(double time) const {
  PhasedTime phased;
  phased.cycles = std::floor(time / period);
  phased.phase = std::fma(-phased.cycles, period, time);
  if (phased.phase < 0) {
    phased.cycles -= 1;
    phased.phase += period;
  } else if (phased.phase >= period) {
    phased.cycles += 1;
    phased.phase -= period;
  }
  const double rounding = std::numeric_limits<double>::epsilon() * time;
  if (phased.phase <= rounding) {
    phased.phase = 0;
  } else if (period - phased.phase <= rounding) {
    phased = {phased.cycles + 1, 0};
  }
  return phased;
}

std::variant<ExtendedWindow, std::string> PeriodicExtension::WindowOf(const Measurement& one) const {
  const std::string one_period = "over one period";
  if (!one.end) {
    return ExtendedWindow{.whole = 1, .parts = {}, .length = period, .note = one.begin > 0 ? one_period : ""};
  }
  const double end = *one.end, length = end - one.begin;
  if (!has_clock) {
    if (length >= period) return ExtendedWindow{.whole = 1, .parts = {}, .length = period, .note = one_period};
    return "its window is shorter than the period " + FormatNumber(period) +
           " of the oscillation, which may begin anywhere.";
  }
  if (end <= period) return ExtendedWindow{.whole = 0, .parts = {{one.begin, end}}, .length = length, .note = ""};
  const PhasedTime from = PhaseOf(one.begin), to = PhaseOf(end);
  ExtendedWindow window{.whole = 0, .parts = {}, .length = length, .note = ""};
  std::string of_parts = "from t = " + FormatNumber(from.phase) + " to " +
                         FormatNumber(to.phase > 0 ? to.phase : period) + " of the period";
  if (from.phase < to.phase) {
    window.parts = {{from.phase, to.phase}};
    window.whole = to.cycles - from.cycles;
  } else {
    if (from.phase > to.phase) {
      window.parts.push_back({from.phase, period});
      if (to.phase > 0) {
        window.parts.push_back({0, to.phase});
        of_parts += " that follows";
      }
    }
    window.whole = to.cycles - from.cycles - (window.parts.empty() ? 0 : 1);
  }
  if (window.whole == 0 && window.parts.empty()) window.parts = {{from.phase, from.phase + length}};
  const std::string periods = window.whole == 1 ? one_period : "over " + FormatNumber(window.whole) + " equal periods";
  window.note = window.whole == 0 ? of_parts : window.parts.empty() ? periods : periods + ", and " + of_parts;
  return window;
}

std::optional<double> PeriodicExtension::CrossingOf(const MeasurementInstant& instant,
                                                    const std::vector<double>& phases) const {
  const auto count = static_cast<double>(phases.size());
  const auto at = [&](double number) {  // from 0 on, of all crossings after 0
    const double cycles = std::floor(number / count);
    return cycles * period + phases[static_cast<std::size_t>(number - cycles * count)];
  };
  const PhasedTime after = PhaseOf(instant.after);
  const auto first = std::lower_bound(phases.begin(), phases.end(), after.phase) - phases.begin();
  double next = after.cycles * count + static_cast<double>(first);
  if (next == 0 && phases.front() == 0) next = 1;  // at 0 nothing has been on the other side
  if (instant.number != MeasurementInstant::kLast) return at(next + instant.number - 1);
  const PhasedTime last = PhaseOf(horizon);
  const auto up_to = std::upper_bound(phases.begin(), phases.end(), last.phase) - phases.begin();
  const double number = last.cycles * count + static_cast<double>(up_to) - 1;
  if (number < next) return std::nullopt;
  return at(number);
}

}  // namespace dlcs
