// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_waveforms.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace dlcs::client {
namespace {

absl::StatusOr<Waveform> MakeWaveform(const DeckFields& fields, std::size_t begin, const std::string& name,
                                      const std::vector<double>& values, const WaveformDefaults& missing,
                                      DeckNotes& notes) {
  const auto at = [&values](std::size_t k, double otherwise) { return k < values.size() ? values[k] : otherwise; };
  const auto too_many = [&](std::size_t most) {
    return DeckError(fields.Place(begin),
                     fmt::format("{} takes at most {} numbers, not {}", name, most, values.size()));
  };
  const auto too_few = [&](std::size_t least) {
    return DeckError(fields.Place(begin),
                     fmt::format("{} takes at least {} numbers, not {}", name, least, values.size()));
  };
  const double stop = missing.stop;
  // One over TSTOP where it is not given.
  const auto frequency = [&](std::size_t k, const char* what) -> absl::StatusOr<double> {
    if (k < values.size() && values[k] == 0) {
      return DeckError(fields.Place(begin),
                       fmt::format("{} of {} is 0, which is 1/TSTOP in ngspice and a constant elsewhere; write what is "
                                   "meant",
                                   what, fields.words[0].text));
    }
    if (k >= values.size()) {
      notes.Add(fmt::format("{}: {} of {} is missing, and taken as 1/TSTOP = {:g} Hz, as in SPICE", fields.Place(begin),
                            what, fields.words[0].text, 1 / stop));
    }
    return at(k, 1 / stop);
  };
  if (name == "pulse") {
    if (values.size() < 2) return too_few(2);
    if (values.size() > 8) return too_many(8);
    PulseWave wave{.low = values[0],
                   .high = values[1],
                   .delay = at(2, 0),
                   .rise = at(3, 0),
                   .fall = at(4, 0),
                   .width = at(5, 0),
                   .period = at(6, 0)};
    std::vector<std::string> defaults;
    const double ramp = missing.ideal_edges ? 0 : missing.step;
    if (wave.rise == 0 && ramp > 0) {
      wave.rise = ramp;
      defaults.push_back(fmt::format("TR = TSTEP = {:g} s", ramp));
    }
    if (wave.fall == 0 && ramp > 0) {
      wave.fall = ramp;
      defaults.push_back(fmt::format("TF = TSTEP = {:g} s", ramp));
    }
    if (ramp == 0 && !missing.ideal_edges && (wave.rise == 0 || wave.fall == 0)) {
      notes.Add(fmt::format("{}: PULSE of {} has ramps of 0 and .tran no TSTEP: its edges are jumps",
                            fields.Place(begin), fields.words[0].text));
    }
    // Ramps that fill the period are meant as a triangle, though ngspice cuts the second one.
    const bool is_triangle = wave.period > 0 && std::abs(wave.rise + wave.fall - wave.period) <= 1e-6 * wave.period;
    if (wave.width == 0 && is_triangle) {
      notes.Add(fmt::format(
          "{}: PULSE of {} is a triangle: PW is 0 and TR + TF = PER, as in LTspice (ngspice takes TSTOP for PW)",
          fields.Place(begin), fields.words[0].text));
    } else if (wave.width == 0 && wave.period > 0) {
      return DeckError(fields.Place(begin),
                       fmt::format("PW of PULSE of {} is 0, which is TSTOP in ngspice and no time in "
                                   "LTspice; for a triangle write a short time, such as {:g}",
                                   fields.words[0].text, 1e-6 * wave.period));
    }
    if (wave.width == 0 && !is_triangle) {
      wave.width = stop;
      defaults.push_back(fmt::format("PW = TSTOP = {:g} s", stop));
    }
    if (wave.period == 0) wave.period = std::numeric_limits<double>::infinity();
    if (at(7, 0) != 0) wave.cycles = values[7];
    if (wave.rise + wave.width + wave.fall > wave.period * (1 + 1e-6)) {
      notes.Add(fmt::format("{}: PULSE of {}: TR + PW + TF = {:g} s is longer than PER = {:g} s, which cuts it",
                            fields.Place(begin), fields.words[0].text, wave.rise + wave.width + wave.fall,
                            wave.period));
    }
    if (!defaults.empty()) {
      notes.Add(fmt::format("{}: PULSE of {} has {}, as in SPICE{}", fields.Place(begin), fields.words[0].text,
                            fmt::join(defaults, ", "),
                            ramp > 0 ? "; dlcs netlist --ideal-edges makes missing ramps jumps" : ""));
    }
    return wave;
  }
  if (name == "sin" || name == "sine") {
    if (values.size() < 2) return too_few(2);
    if (values.size() > 7) return too_many(7);
    const auto hertz = frequency(2, "FREQ of SIN");
    if (!hertz.ok()) return hertz.status();
    SineWave wave{.offset = values[0],
                  .amplitude = values[1],
                  .frequency = *hertz,
                  .delay = at(3, 0),
                  .damping = at(4, 0),
                  .phase = at(5, 0)};
    if (at(6, 0) != 0) {
      wave.cycles = values[6];
      notes.Add(fmt::format("{}: SIN of {} ends after {:g} cycles, as in LTspice (ngspice goes on)",
                            fields.Place(begin), fields.words[0].text, wave.cycles));
    }
    return wave;
  }
  if (name == "exp") {
    if (values.size() < 2) return too_few(2);
    if (values.size() > 6) return too_many(6);
    const double step = missing.step > 0 ? missing.step : stop / 50;
    const double rise_delay = at(2, 0), fall_delay = at(4, rise_delay + step);
    if (values.size() < 6) {
      notes.Add(
          fmt::format("{}: EXP of {} has what it does not give from TSTEP: TAU1 = {:g}, TD2 = {:g}, TAU2 = {:g} s",
                      fields.Place(begin), fields.words[0].text, at(3, step), fall_delay, at(5, step)));
    }
    if (fall_delay < rise_delay) {
      return DeckError(fields.Place(begin), fmt::format("EXP of {}: TD2 = {:g} is before TD1 = {:g}",
                                                        fields.words[0].text, fall_delay, rise_delay));
    }
    return ExponentialWave{.first = values[0],
                           .second = values[1],
                           .rise_delay = rise_delay,
                           .rise = at(3, step),
                           .fall_delay = fall_delay,
                           .fall = at(5, step)};
  }
  if (name == "sffm") {
    if (values.size() < 2) return too_few(2);
    if (values.size() > 5) return too_many(5);
    const auto carrier = frequency(2, "FC of SFFM"), signal = frequency(4, "FS of SFFM");
    if (!carrier.ok()) return carrier.status();
    if (!signal.ok()) return signal.status();
    return FrequencyModulatedWave{
        .offset = values[0], .amplitude = values[1], .carrier = *carrier, .index = at(3, 0), .signal = *signal};
  }
  if (name == "am") {
    if (values.size() < 4) return too_few(4);
    if (values.size() > 8) return too_many(8);
    // The order of the numbers has changed. The carrier is faster than its signal, and no delay in seconds is longer
    // than a carrier in Hz is fast: so only the newer order has a fifth number above the fourth.
    const bool is_newer = at(4, 0) > 0 && at(4, 0) >= values[3];
    for (std::size_t k = is_newer ? 6 : 5; k < values.size(); ++k) {
      if (values[k] == 0) continue;
      return DeckError(fields.Place(begin), fmt::format("phases of AM of {} are not supported", fields.words[0].text));
    }
    notes.Add(fmt::format("{}: AM of {} has the order {}", fields.Place(begin), fields.words[0].text,
                          is_newer ? "VO VMO VMA FM FC TD of newer versions of ngspice, not VA VO MF FC TD"
                                   : "VA VO MF FC TD of ngspice 39, not VO VMO VMA FM FC TD of newer versions"));
    if (is_newer) {
      return AmplitudeModulatedWave{.offset = values[0],
                                    .mean = values[1],
                                    .depth = values[2],
                                    .signal = values[3],
                                    .carrier = values[4],
                                    .delay = at(5, 0)};
    }
    return AmplitudeModulatedWave{.mean = values[0] * values[1],
                                  .depth = values[0],
                                  .signal = values[2],
                                  .carrier = values[3],
                                  .delay = at(4, 0)};
  }
  return DeckError(fields.Place(begin),
                   fmt::format("{}: the function {} is not supported; known are PULSE, SIN, PWL, "
                               "EXP, SFFM and AM{}",
                               fields.words[0].text, fields.words[begin].text, HintOnBlank(fields, begin)));
}

// What LTspice writes REPEAT FOR 3 (...) ENDREPEAT, or FOREVER; and r=TIME of ngspice, with its delay td=TIME.
struct Repetition {
  bool is_asked = false;                                   // by REPEAT
  double times = std::numeric_limits<double>::infinity();  // how often the points are gone through
};

absl::StatusOr<Waveform> MakePiecewiseLinear(const DeckFields& fields, std::size_t begin,
                                             const std::vector<double>& values, const Repetition& repetition,
                                             ParameterScope& scope, DeckNotes& notes) {
  constexpr double kMaxPoints = 1e5;
  if (values.size() < 2 || values.size() % 2 != 0) {
    return DeckError(fields.Place(begin), "PWL takes pairs of time and value");
  }
  std::map<std::string, double> named;
  for (const char* name : {"r", "td"}) {
    const auto given = fields.named.find(name);
    if (given == fields.named.end()) continue;
    const auto value = ValueOf(*fields.line, given->second, scope, notes);
    if (!value.ok()) return value.status();
    named[name] = *value;
  }
  const double delay = named.contains("td") ? named["td"] : 0;
  PiecewiseLinearWave wave;
  for (std::size_t k = 0; k < values.size(); k += 2) {
    wave.times.push_back(values[k] + delay);
    wave.values.push_back(values[k + 1]);
  }
  // r=-1 is none.
  if (named.contains("r") && named["r"] >= 0) wave.repeats_from = named["r"] + delay;
  if (!repetition.is_asked) return wave;
  if (wave.repeats_from) return DeckError(fields.Place(begin), "PWL repeats by REPEAT or by r=, not by both");
  if (!std::isfinite(repetition.times)) {
    wave.repeats_from = delay;
    return wave;
  }
  const double period = values[values.size() - 2];
  if (!(repetition.times >= 1) || !(repetition.times * static_cast<double>(wave.times.size()) <= kMaxPoints)) {
    return DeckError(fields.Place(begin),
                     fmt::format("PWL is repeated {:g} times; must be at least 1, and give {:g} points at most",
                                 repetition.times, kMaxPoints));
  }
  const std::size_t points = wave.times.size();
  for (double k = 1; k < repetition.times; ++k) {
    for (std::size_t point = 0; point < points; ++point) {
      wave.times.push_back(wave.times[point] + k * period);
      wave.values.push_back(wave.values[point]);
    }
  }
  return wave;
}

}  // namespace

Waveform TurnedOn(const Waveform& wave, double horizon) {
  constexpr double kRamp = 20e-6;  // s
  if (const auto* constant = std::get_if<ConstantWave>(&wave)) {
    return PiecewiseLinearWave{.times = {0, kRamp}, .values = {0, constant->value}};
  }
  std::vector<double> cuts = Cuts(wave, horizon);
  cuts.push_back(horizon);
  std::string pieces;
  double begin = 0;
  for (const double end : cuts) {
    const std::string formula = "(" + FormulaNear(wave, begin + (end - begin) / 2) + ")";
    if (cuts.size() == 1) {
      pieces = formula;
    } else {
      const std::string until = end < horizon ? fmt::format("*(t < {:.17g})", end) : "";
      pieces += fmt::format("{}(t >= {:.17g}){}*{}", pieces.empty() ? "" : " + ", begin, until, formula);
    }
    begin = end;
  }
  return FormulaWave{fmt::format("min(1, t/{:g})*({})", kRamp, pieces), Peak(wave)};
}

bool IsWaveform(const std::string& lower) {
  static const std::set<std::string> kNames = {"pulse", "sin", "sine", "pwl", "exp", "sffm", "am"};
  return kNames.contains(lower);
}

absl::StatusOr<Waveform> ReadWaveform(const DeckFields& fields, std::size_t& k, const WaveformDefaults& defaults,
                                      ParameterScope& scope, DeckNotes& notes) {
  const std::size_t begin = k;
  const std::string name = Lower(fields.words[k++].text);
  std::vector<double> values;
  const bool in_parentheses = k < fields.words.size() && fields.words[k].text == "(";
  if (in_parentheses) ++k;
  bool closed = false;
  int inner = 0;  // PWL may have its points in parentheses
  Repetition repetition;
  for (; k < fields.words.size(); ++k) {
    const std::string& text = fields.words[k].text;
    if (text == "(") {
      ++inner;
      continue;
    }
    if (text == ")") {
      if (inner-- > 0) continue;
      closed = true;
      ++k;
      break;
    }
    const bool is_word = !fields.words[k].is_expression && std::isalpha(static_cast<unsigned char>(text[0])) != 0;
    if (name == "pwl" && is_word && (!values.empty() || Lower(text) == "repeat")) {
      const std::string word = Lower(text);
      if (word == "endrepeat" && repetition.is_asked) {
        if (in_parentheses) continue;
        ++k;
        break;
      }
      if (word != "repeat" || !values.empty() || repetition.is_asked) {
        return DeckError(fields.Place(k), fmt::format("{} of PWL is not supported; PWL takes pairs of time and value, "
                                                      "and REPEAT FOREVER (...) ENDREPEAT or r=TIME repeats them",
                                                      text));
      }
      repetition.is_asked = true;
      const std::string how = k + 1 < fields.words.size() ? Lower(fields.words[k + 1].text) : "";
      if (how == "forever") {
        ++k;
      } else if (how == "for" && k + 2 < fields.words.size()) {
        const auto count = ValueOf(*fields.line, fields.words[k + 2], scope, notes);
        if (!count.ok()) return count.status();
        repetition.times = *count;
        k += 2;
      } else {
        return DeckError(fields.Place(k), "REPEAT of PWL is written REPEAT FOREVER (...) ENDREPEAT, or REPEAT FOR 3");
      }
      continue;
    }
    if (!in_parentheses && is_word) break;
    // After a time of 0 both meanings are the same.
    const bool is_relative = values.size() >= 2 && values[values.size() - 2] != 0;
    if (name == "pwl" && values.size() % 2 == 0 && is_relative && text.starts_with('+')) {
      return DeckError(fields.Place(k), fmt::format("{} of PWL: a time after the one before in LTspice, since 0 in "
                                                    "ngspice; write it without +",
                                                    text));
    }
    const auto value = ValueOf(*fields.line, fields.words[k], scope, notes);
    if (!value.ok()) return value.status();
    values.push_back(*value);
  }
  if (in_parentheses && !closed) return DeckError(fields.Place(begin), fmt::format("{}: \")\" is missing", name));
  if (name == "pwl") return MakePiecewiseLinear(fields, begin, values, repetition, scope, notes);
  return MakeWaveform(fields, begin, name, values, defaults, notes);
}

}  // namespace dlcs::client
