// SPDX-License-Identifier: Apache-2.0
// A solution on one period as one for all times.

#ifndef DLCS_CORE_OUTPUTS_PERIODIC_EXTENSION_H_
#define DLCS_CORE_OUTPUTS_PERIODIC_EXTENSION_H_

#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/problem/outputs.h"

namespace dlcs {

// A time as `cycles` periods and `phase`, in [0, period).
struct PhasedTime {
  double cycles = 0;
  double phase = 0;
};

// What a measurement covers: the whole period `whole` times, and these parts of it once.
struct ExtendedWindow {
  struct Part {
    double begin = 0;
    double end = 0;
  };
  double whole = 0;
  std::vector<Part> parts;
  double length = 0;  // of all
  std::string note;   // what is covered, where a reader might expect something else
};

// The solution on [0, period] is repeated for ever, and the measurements of a problem on [0, horizon] are those of what
// results: a window of the problem is taken modulo the period, and the n-th crossing of a level is that after the first
// ones in as many periods as it takes.
struct PeriodicExtension {
  double period = 0;
  double horizon = 0;
  // Times of the problem mean times of the period, since the sources have this period. False for an oscillation, which
  // begins anywhere: of it only whole periods are measured, and crossings.
  bool has_clock = true;

  // `time` >= 0. A time that is a multiple of the period but for rounding is one: `time` and the period are both
  // rounded to half an ulp, which makes ε `time` of their quotient.
  PhasedTime PhaseOf(double time) const;
  // From `begin` to `end`; without an end what is meant is from when on the solution is periodic, and that is one
  // period. A sentence where the window means nothing.
  std::variant<ExtendedWindow, std::string> WindowOf(const Measurement& one) const;
  // The time as one of the period, [0, period].
  double InPeriod(double time) const { return time <= period ? time : PhaseOf(time).phase; }
  // The time > 0 at which a level is crossed, if it is crossed at the times `phases` of the period, increasing, at
  // least one. Absent if the last one up to the horizon comes before `instant.after`.
  std::optional<double> CrossingOf(const MeasurementInstant& instant, const std::vector<double>& phases) const;
};

}  // namespace dlcs

#endif  // DLCS_CORE_OUTPUTS_PERIODIC_EXTENSION_H_
