// SPDX-License-Identifier: Apache-2.0
// The independent sources of SPICE as functions of time.

#ifndef DLCS_CORE_CIRCUITS_WAVEFORM_H_
#define DLCS_CORE_CIRCUITS_WAVEFORM_H_

#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace dlcs {

struct ConstantWave {
  double value = 0;
};

// From `low` at `delay` to `high` within `rise`, for `width`, and back within `fall`; again after each `period`, and
// `low` after `cycles` of them. A ramp of 0 s is a jump. A pulse that is longer than its period jumps back at its end.
struct PulseWave {
  double low = 0, high = 0;
  double delay = 0, rise = 0, fall = 0;  // s, >= 0
  double width = 0;                      // s, >= 0
  double period = std::numeric_limits<double>::infinity();
  double cycles = std::numeric_limits<double>::infinity();  // >= 1, whole
};

// offset + amplitude e^{-damping (t - delay)} sin(2π frequency (t - delay) + phase) from `delay` on, for `cycles`
// periods; before and after it the value at `delay`, which may be before 0.
struct SineWave {
  double offset = 0, amplitude = 0;
  double frequency = 0;                                     // Hz
  double delay = 0;                                         // s
  double damping = 0;                                       // 1/s
  double phase = 0;                                         // degrees
  double cycles = std::numeric_limits<double>::infinity();  // above 0, of a frequency above 0
};

// Straight lines through points; constant before the first and after the last. Two points at one time are a jump. With
// `repeats_from` the part from that time to the last point is repeated forever.
struct PiecewiseLinearWave {
  std::vector<double> times;  // s, not decreasing
  std::vector<double> values;
  std::optional<double> repeats_from = {};  // s, >= 0, before the last of `times`
};

// first + (second - first)(1 - e^{-(t - rise_delay)/rise}) from `rise_delay` on, and back from `fall_delay` on.
struct ExponentialWave {
  double first = 0, second = 0;
  double rise_delay = 0, rise = 1, fall_delay = 0, fall = 1;  // s
};

// offset + amplitude sin(2π carrier t + index sin(2π signal t))
struct FrequencyModulatedWave {
  double offset = 0, amplitude = 0;
  double carrier = 0;  // Hz
  double index = 0;
  double signal = 0;  // Hz
};

// offset + (mean + depth sin(2π signal (t - delay))) sin(2π carrier (t - delay)) from `delay` on, before it 0.
struct AmplitudeModulatedWave {
  double offset = 0, mean = 0, depth = 0;
  double signal = 0, carrier = 0;  // Hz
  double delay = 0;                // s, >= 0
};

// 0 or 1; changes at each of `times`.
struct GateWave {
  bool starts_closed = false;
  std::vector<double> times;  // s, increasing
};

// A formula in t (core/problem/formula.h). Its derivative is not known.
struct FormulaWave {
  std::string text;
  double peak = 0;  // a rough bound of its absolute value; only the order of magnitude matters
};

using Waveform = std::variant<ConstantWave, PulseWave, SineWave, PiecewiseLinearWave, ExponentialWave,
                              FrequencyModulatedWave, AmplitudeModulatedWave, GateWave, FormulaWave>;

// Why the numbers of a waveform are invalid; empty if they are valid.
std::string FaultOf(const Waveform& wave);

// The times in (0, horizon) at which a formula of the waveform ends: the points of a piecewise linear one, the edges of
// a gate, the end of a sine. The formulas of the others hold for all times.
std::vector<double> Cuts(const Waveform& wave, double horizon);

// The waveform between two of its cuts as a formula in t (core/problem/formula.h); `inside` is a time there.
std::string FormulaNear(const Waveform& wave, double inside);
// Whether DerivativeNear() knows the derivative.
bool HasDerivative(const Waveform& wave);
// The derivative of the waveform with respect to t, without the impulses of jumps.
std::string DerivativeNear(const Waveform& wave, double inside);
// Whether the waveform jumps in (0, horizon).
bool HasJump(const Waveform& wave, double horizon);

// The limit from the right at 0.
double StartValue(const Waveform& wave);
// A bound of its absolute value for t >= 0.
double Peak(const Waveform& wave);

// Straight lines through the points (x, y) as a formula of `argument`, a formula: 0 before the first point, the last
// value after the last one. Two points at one x are a jump, to the second value where `argument` is x.
std::string LinesText(const std::vector<double>& x, const std::vector<double>& y, const std::string& argument);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_WAVEFORM_H_
