// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/waveform.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

#include "core/format_number.h"
#include "core/problem/formula.h"

namespace dlcs {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
// Times, and values at them, that differ by less than this part are the same.
constexpr double kRounding = 1e-12;

// A number in a formula: in parentheses where it has a sign.
std::string Number(double value) { return value < 0 ? "(" + NumberText(value) + ")" : NumberText(value); }

std::string Plus(const std::string& sum, const std::string& term) {
  if (term == "0") return sum;
  return sum == "0" ? term : sum + " + " + term;
}

// t - delay
std::string Since(double delay) { return delay == 0 ? "t" : "(t - " + Number(delay) + ")"; }
// 1 from `delay` on, as a factor.
std::string From(double delay) { return delay <= 0 ? "" : "(t >= " + NumberText(delay) + ")*"; }

// The time since the last start of a period.
std::string Phase(const PulseWave& wave) {
  const std::string since = Since(wave.delay);
  if (!std::isfinite(wave.period)) return since;
  return "(" + since + " - " + Number(wave.period) + "*floor(" + since + "/" + Number(wave.period) + "))";
}

// How far the pulse is up, from 0 to 1, as a formula.
std::string Height(const PulseWave& wave) {
  const std::string phase = Phase(wave);
  const double high_end = wave.rise + wave.width, end = high_end + wave.fall;
  const std::string up = phase + "/" + Number(wave.rise);
  const std::string down = "(" + Number(end) + " - " + phase + ")/" + Number(wave.fall);
  if (wave.rise > 0 && wave.fall > 0) return "max(0, min(1, " + up + ", " + down + "))";
  if (wave.fall > 0) return "max(0, min(1, " + down + "))";
  const std::string before_end = "(" + phase + " < " + Number(end) + ")";
  return wave.rise > 0 ? before_end + "*max(0, min(1, " + up + "))" : before_end;
}

// 0 after the last period, as a factor.
std::string UpToEnd(const PulseWave& wave) {
  const double end = wave.delay + wave.cycles * wave.period;
  return std::isfinite(end) ? "*(t < " + NumberText(end) + ")" : "";
}

std::string TextOf(const ConstantWave& wave, double) { return NumberText(wave.value); }

std::string TextOf(const PulseWave& wave, double) {
  if (wave.low == wave.high) return NumberText(wave.low);
  const std::string step = From(wave.delay) + Height(wave) + UpToEnd(wave);
  const double change = wave.high - wave.low;
  return Plus(NumberText(wave.low), change == 1 ? step : Number(change) + "*" + step);
}

// After its cycles.
double EndOf(const SineWave& wave) { return wave.delay + wave.cycles / wave.frequency; }

double ValueAt(const SineWave& wave, double time) {
  const double since = std::max(0.0, time - wave.delay);
  return wave.offset + wave.amplitude * std::exp(-wave.damping * since) *
                           std::sin(kTwoPi * wave.frequency * since + wave.phase * std::numbers::pi / 180);
}

// Before and after its cycles.
double RestOf(const SineWave& wave) { return ValueAt(wave, wave.delay); }

std::string TextOf(const SineWave& wave, double inside) {
  if (std::isfinite(wave.cycles) && inside >= EndOf(wave)) return NumberText(RestOf(wave));
  const std::string since = wave.delay > 0 ? "max(0, " + Since(wave.delay) + ")" : Since(wave.delay);
  std::string angle = Number(kTwoPi * wave.frequency) + "*" + since;
  if (wave.phase != 0) angle += " + " + Number(wave.phase * std::numbers::pi / 180);
  std::string term = Number(wave.amplitude) + "*sin(" + angle + ")";
  if (wave.damping != 0) term += "*exp(" + Number(-wave.damping) + "*" + since + ")";
  return Plus(NumberText(wave.offset), term);
}

// The line of the piece that holds `inside`, as value and slope at the time of its start.
struct Line {
  double time = 0, value = 0, slope = 0;
};

Line LineAt(const PiecewiseLinearWave& wave, double inside) {
  const auto next = std::upper_bound(wave.times.begin(), wave.times.end(), inside);
  const auto k = static_cast<std::size_t>(next - wave.times.begin());
  if (k == 0) return {0, wave.values.front(), 0};
  if (k == wave.times.size()) return {0, wave.values.back(), 0};
  const double length = wave.times[k] - wave.times[k - 1];
  return {wave.times[k - 1], wave.values[k - 1], (wave.values[k] - wave.values[k - 1]) / length};
}

// The time in the points of a wave that repeats.
std::string RepeatedTime(const PiecewiseLinearWave& wave) {
  const double from = *wave.repeats_from;
  const std::string period = Number(wave.times.back() - from);
  if (from == 0) return "(t - " + period + "*floor(t/" + period + "))";
  const std::string behind = "max(0, t - " + Number(from) + ")";
  return "(min(t, " + Number(from) + ") + " + behind + " - " + period + "*floor(" + behind + "/" + period + "))";
}

double ValueAt(const PiecewiseLinearWave& wave, double time) {
  const Line line = LineAt(wave, time);
  return line.value + line.slope * (time - line.time);
}

std::string TextOf(const PiecewiseLinearWave& wave, double inside) {
  if (wave.repeats_from) {
    return Plus(NumberText(wave.values.front()), LinesText(wave.times, wave.values, RepeatedTime(wave)));
  }
  const Line line = LineAt(wave, inside);
  if (line.slope == 0) return NumberText(line.value);
  return Plus(NumberText(line.value), Number(line.slope) + "*" + Since(line.time));
}

// 1 - e^{-(t - delay)/time} from `delay` on, else 0.
std::string Approach(double delay, double time) {
  const std::string since = delay > 0 ? "max(0, " + Since(delay) + ")" : Since(delay);
  return "(1 - exp(-" + since + "/" + Number(time) + "))";
}

std::string TextOf(const ExponentialWave& wave, double) {
  const double change = wave.second - wave.first;
  return NumberText(wave.first) + " + " + Number(change) + "*" + Approach(wave.rise_delay, wave.rise) + " - " +
         Number(change) + "*" + Approach(wave.fall_delay, wave.fall);
}

std::string Angle(const FrequencyModulatedWave& wave) {
  return Number(kTwoPi * wave.carrier) + "*t + " + Number(wave.index) + "*sin(" + Number(kTwoPi * wave.signal) + "*t)";
}

std::string TextOf(const FrequencyModulatedWave& wave, double) {
  return Plus(NumberText(wave.offset), Number(wave.amplitude) + "*sin(" + Angle(wave) + ")");
}

std::string SineText(double frequency, double delay) {
  return "sin(" + Number(kTwoPi * frequency) + "*" + Since(delay) + ")";
}

std::string TextOf(const AmplitudeModulatedWave& wave, double) {
  return From(wave.delay) + "(" + NumberText(wave.offset) + " + (" + NumberText(wave.mean) + " + " +
         Number(wave.depth) + "*" + SineText(wave.signal, wave.delay) + ")*" + SineText(wave.carrier, wave.delay) + ")";
}

bool IsClosed(const GateWave& wave, double inside) {
  const auto edges = std::upper_bound(wave.times.begin(), wave.times.end(), inside) - wave.times.begin();
  return wave.starts_closed != (edges % 2 == 1);
}

std::string TextOf(const GateWave& wave, double inside) { return IsClosed(wave, inside) ? "1" : "0"; }

std::string TextOf(const FormulaWave& wave, double) { return wave.text; }

std::string Derivative(const ConstantWave&, double) { return "0"; }

std::string Derivative(const PulseWave& wave, double) {
  const std::string phase = Phase(wave);
  const double change = wave.high - wave.low, high_end = wave.rise + wave.width, end = high_end + wave.fall;
  std::string slope = "0";
  if (change != 0 && wave.rise > 0) {
    slope = Number(change / wave.rise) + "*" + From(wave.delay) + "(" + phase + " < " + Number(wave.rise) + ")";
  }
  if (change != 0 && wave.fall > 0) {
    slope = Plus(slope, Number(-change / wave.fall) + "*" + From(wave.delay) + "(" + phase + " >= " + Number(high_end) +
                            ")*(" + phase + " < " + Number(end) + ")");
  }
  const std::string up_to_end = UpToEnd(wave);
  return slope == "0" || up_to_end.empty() ? slope : "(" + slope + ")" + up_to_end;
}

std::string Derivative(const SineWave& wave, double inside) {
  if (std::isfinite(wave.cycles) && inside >= EndOf(wave)) return "0";
  const std::string since = wave.delay > 0 ? "max(0, " + Since(wave.delay) + ")" : Since(wave.delay);
  const double omega = kTwoPi * wave.frequency;
  std::string angle = Number(omega) + "*" + since;
  if (wave.phase != 0) angle += " + " + Number(wave.phase * std::numbers::pi / 180);
  std::string term = Number(omega * wave.amplitude) + "*cos(" + angle + ")";
  if (wave.damping != 0) {
    term = "(" + term + " - " + Number(wave.damping * wave.amplitude) + "*sin(" + angle + "))*exp(" +
           Number(-wave.damping) + "*" + since + ")";
  }
  return From(wave.delay) + term;
}

std::string Derivative(const PiecewiseLinearWave& wave, double inside) {
  if (wave.repeats_from) {
    const std::string time = RepeatedTime(wave);
    std::string slope = "0";
    for (std::size_t k = 0; k + 1 < wave.times.size(); ++k) {
      const double run = wave.times[k + 1] - wave.times[k], rise = wave.values[k + 1] - wave.values[k];
      if (!(run > 0) || rise == 0) continue;
      slope = Plus(slope, Number(rise / run) + "*(" + time + " >= " + Number(wave.times[k]) + ")*(" + time + " < " +
                              Number(wave.times[k + 1]) + ")");
    }
    return slope;
  }
  return NumberText(LineAt(wave, inside).slope);
}

std::string Derivative(const ExponentialWave& wave, double) {
  const double change = wave.second - wave.first;
  const auto slope = [](double delay, double time, double factor) {
    return From(delay) + Number(factor / time) + "*exp(-" +
           (delay > 0 ? "max(0, " + Since(delay) + ")" : Since(delay)) + "/" + Number(time) + ")";
  };
  return slope(wave.rise_delay, wave.rise, change) + " + " + slope(wave.fall_delay, wave.fall, -change);
}

std::string Derivative(const FrequencyModulatedWave& wave, double) {
  return Number(wave.amplitude) + "*(" + Number(kTwoPi * wave.carrier) + " + " +
         Number(wave.index * kTwoPi * wave.signal) + "*cos(" + Number(kTwoPi * wave.signal) + "*t))*cos(" +
         Angle(wave) + ")";
}

std::string Derivative(const AmplitudeModulatedWave& wave, double) {
  const auto cosine = [&wave](double frequency) {
    return Number(kTwoPi * frequency) + "*cos(" + Number(kTwoPi * frequency) + "*" + Since(wave.delay) + ")";
  };
  const std::string signal = SineText(wave.signal, wave.delay), carrier = SineText(wave.carrier, wave.delay);
  return From(wave.delay) + "(" + Number(wave.depth) + "*" + cosine(wave.signal) + "*" + carrier + " + (" +
         NumberText(wave.mean) + " + " + Number(wave.depth) + "*" + signal + ")*" + cosine(wave.carrier) + ")";
}

std::string Derivative(const GateWave&, double) { return "0"; }

std::string Derivative(const FormulaWave&, double) { return "0"; }

bool IsFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

std::string Fault(const ConstantWave& wave) { return std::isfinite(wave.value) ? "" : "the value is not finite"; }

std::string Fault(const PulseWave& wave) {
  if (!IsFinite({wave.low, wave.high, wave.delay, wave.rise, wave.fall})) return "a number of PULSE is not finite";
  if (wave.delay < 0 || wave.rise < 0 || wave.fall < 0 || !(wave.width >= 0)) {
    return "TD, TR, TF and PW of PULSE must be at least 0";
  }
  if (!(wave.period > 0)) return "PER of PULSE is " + NumberText(wave.period) + "; must be above 0";
  if (!(wave.cycles >= 1) || (std::isfinite(wave.cycles) && wave.cycles != std::floor(wave.cycles))) {
    return "the number of pulses of PULSE is " + NumberText(wave.cycles) + "; must be a whole number from 1 on";
  }
  return "";
}

std::string Fault(const SineWave& wave) {
  if (!IsFinite({wave.offset, wave.amplitude, wave.frequency, wave.delay, wave.damping, wave.phase})) {
    return "a number of SIN is not finite";
  }
  if (!(wave.cycles > 0)) return "the number of cycles of SIN is " + NumberText(wave.cycles) + "; must be above 0";
  if (std::isfinite(wave.cycles) && !(wave.frequency > 0)) return "FREQ of SIN with cycles must be above 0";
  return "";
}

std::string Fault(const PiecewiseLinearWave& wave) {
  if (wave.times.empty() || wave.times.size() != wave.values.size()) return "PWL needs pairs of time and value";
  if (!IsFinite(wave.times) || !IsFinite(wave.values)) return "a number of PWL is not finite";
  for (std::size_t k = 1; k < wave.times.size(); ++k) {
    if (wave.times[k] < wave.times[k - 1]) {
      return "the time " + NumberText(wave.times[k]) + " of PWL comes after " + NumberText(wave.times[k - 1]) +
             "; times must increase";
    }
  }
  if (wave.repeats_from && !(*wave.repeats_from >= 0 && *wave.repeats_from < wave.times.back())) {
    return "PWL repeats from " + NumberText(*wave.repeats_from) + " on; must be at least 0 and before its last time, " +
           NumberText(wave.times.back());
  }
  return "";
}

std::string Fault(const ExponentialWave& wave) {
  if (!IsFinite({wave.first, wave.second, wave.rise_delay, wave.rise, wave.fall_delay, wave.fall})) {
    return "a number of EXP is not finite";
  }
  if (!(wave.rise > 0) || !(wave.fall > 0)) return "TAU1 and TAU2 of EXP must be above 0";
  return wave.rise_delay < 0 || wave.fall_delay < 0 ? "TD1 and TD2 of EXP must be at least 0" : "";
}

std::string Fault(const FrequencyModulatedWave& wave) {
  return IsFinite({wave.offset, wave.amplitude, wave.carrier, wave.index, wave.signal})
             ? ""
             : "a number of SFFM is not finite";
}

std::string Fault(const AmplitudeModulatedWave& wave) {
  if (!IsFinite({wave.offset, wave.mean, wave.depth, wave.signal, wave.carrier, wave.delay})) {
    return "a number of AM is not finite";
  }
  return wave.delay < 0 ? "TD of AM must be at least 0" : "";
}

std::string Fault(const FormulaWave& wave) {
  const double start = StartValue(wave);
  return std::isfinite(start) && std::isfinite(wave.peak) ? "" : "its expression is not finite at all times";
}

std::string Fault(const GateWave& wave) { return IsFinite(wave.times) ? "" : "a time is not finite"; }

}  // namespace

std::string FaultOf(const Waveform& wave) {
  return std::visit([](const auto& given) { return Fault(given); }, wave);
}

std::vector<double> Cuts(const Waveform& wave, double horizon) {
  const std::vector<double>* times = nullptr;
  if (const auto* line = std::get_if<PiecewiseLinearWave>(&wave); line != nullptr && !line->repeats_from) {
    times = &line->times;
  }
  if (const auto* gate = std::get_if<GateWave>(&wave)) times = &gate->times;
  std::vector<double> cuts, end;
  if (const auto* sine = std::get_if<SineWave>(&wave); sine != nullptr && std::isfinite(sine->cycles)) {
    end = {EndOf(*sine)};
    times = &end;
  }
  if (times == nullptr) return cuts;
  for (const double time : *times) {
    if (time > 0 && time < horizon && (cuts.empty() || cuts.back() < time)) cuts.push_back(time);
  }
  return cuts;
}

std::string FormulaNear(const Waveform& wave, double inside) {
  return std::visit([inside](const auto& given) { return TextOf(given, inside); }, wave);
}

bool HasDerivative(const Waveform& wave) { return !std::holds_alternative<FormulaWave>(wave); }

std::string DerivativeNear(const Waveform& wave, double inside) {
  return std::visit([inside](const auto& given) { return Derivative(given, inside); }, wave);
}

bool HasJump(const Waveform& wave, double horizon) {
  if (const auto* pulse = std::get_if<PulseWave>(&wave)) {
    if (pulse->low == pulse->high || pulse->delay >= horizon) return false;
    const bool is_too_long = pulse->rise + pulse->width + pulse->fall > pulse->period * (1 + kRounding);
    // A pulse that starts to rise at 0 with no ramp does not jump there: it starts high.
    const bool rises = pulse->rise == 0 && (pulse->delay > 0 || pulse->delay + pulse->period < horizon);
    const bool falls = pulse->fall == 0 && pulse->delay + pulse->rise + pulse->width < horizon;
    const bool is_cut = is_too_long && pulse->delay + pulse->period < horizon;
    return rises || falls || is_cut;
  }
  if (const auto* line = std::get_if<PiecewiseLinearWave>(&wave)) {
    for (std::size_t k = 1; k < line->times.size(); ++k) {
      const bool same = line->times[k] == line->times[k - 1] && line->values[k] != line->values[k - 1];
      if (same && line->times[k] > 0 && line->times[k] < horizon) return true;
    }
    return line->repeats_from && line->times.back() < horizon &&
           ValueAt(*line, *line->repeats_from) != line->values.back();
  }
  if (const auto* sine = std::get_if<SineWave>(&wave)) {
    return !Cuts(wave, horizon).empty() &&
           std::abs(ValueAt(*sine, EndOf(*sine)) - RestOf(*sine)) > kRounding * std::abs(sine->amplitude);
  }
  if (const auto* modulated = std::get_if<AmplitudeModulatedWave>(&wave)) {
    return modulated->offset != 0 && modulated->delay > 0 && modulated->delay < horizon;
  }
  return std::holds_alternative<GateWave>(wave) && !Cuts(wave, horizon).empty();
}

double StartValue(const Waveform& wave) {
  struct Start {
    double operator()(const ConstantWave& given) const { return given.value; }
    double operator()(const PulseWave& given) const {
      return given.delay <= 0 && given.rise == 0 && given.width + given.fall > 0 ? given.high : given.low;
    }
    double operator()(const SineWave& given) const {
      return std::isfinite(given.cycles) && EndOf(given) <= 0 ? RestOf(given) : ValueAt(given, 0);
    }
    double operator()(const PiecewiseLinearWave& given) const { return ValueAt(given, 0); }
    double operator()(const ExponentialWave& given) const { return given.first; }
    double operator()(const FrequencyModulatedWave& given) const { return given.offset; }
    double operator()(const AmplitudeModulatedWave& given) const { return given.delay > 0 ? 0 : given.offset; }
    double operator()(const GateWave& given) const { return IsClosed(given, 0) ? 1 : 0; }
    double operator()(const FormulaWave& given) const {
      auto formula = Formula::Parse(given.text);
      // Not at 0 itself: (t > 0) is 1 from the right. What is as small as that time is 0.
      const double value = formula.ok() ? formula->Evaluate(std::numeric_limits<double>::denorm_min()) : std::nan("");
      return std::abs(value) < std::numeric_limits<double>::min() ? 0 : value;
    }
  };
  return std::visit(Start(), wave);
}

double Peak(const Waveform& wave) {
  struct Largest {
    double operator()(const ConstantWave& given) const { return std::abs(given.value); }
    double operator()(const PulseWave& given) const { return std::max(std::abs(given.low), std::abs(given.high)); }
    double operator()(const SineWave& given) const { return std::abs(given.offset) + std::abs(given.amplitude); }
    double operator()(const PiecewiseLinearWave& given) const {
      double largest = 0;
      for (const double value : given.values) largest = std::max(largest, std::abs(value));
      return largest;
    }
    double operator()(const ExponentialWave& given) const {
      return std::abs(given.first) + 2 * std::abs(given.second - given.first);
    }
    double operator()(const FrequencyModulatedWave& given) const {
      return std::abs(given.offset) + std::abs(given.amplitude);
    }
    double operator()(const AmplitudeModulatedWave& given) const {
      return std::abs(given.offset) + std::abs(given.mean) + std::abs(given.depth);
    }
    double operator()(const GateWave&) const { return 1; }
    double operator()(const FormulaWave& given) const { return given.peak; }
  };
  return std::visit(Largest(), wave);
}

std::string LinesText(const std::vector<double>& x, const std::vector<double>& y, const std::string& argument) {
  std::string text = "0";
  for (std::size_t k = 0; k + 1 < x.size(); ++k) {
    const double run = x[k + 1] - x[k], rise = y[k + 1] - y[k];
    if (rise == 0) continue;
    const std::string part = run > 0 ? Number(rise / run) + "*(min(max(" + argument + ", " + NumberText(x[k]) + "), " +
                                           NumberText(x[k + 1]) + ") - " + Number(x[k]) + ")"
                                     : Number(rise) + "*(" + argument + " >= " + NumberText(x[k]) + ")";
    text = Plus(text, part);
  }
  return text;
}

}  // namespace dlcs
