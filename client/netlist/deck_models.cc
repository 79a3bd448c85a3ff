// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_models.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace dlcs::client {
namespace {

constexpr double kThermalVoltage = 1.380649e-23 * 300.15 / 1.602176634e-19;  // at 27 degrees, as SPICE has it

// The numbers of a model: each name must be in `known` or in `ignored`.
absl::StatusOr<std::map<std::string, double>> ValuesOf(const DeckModel& model, const std::string& name,
                                                       ParameterScope& scope, DeckNotes& notes,
                                                       const std::set<std::string>& known,
                                                       const std::set<std::string>& ignored) {
  std::map<std::string, double> values;
  std::vector<std::string> left_out;
  for (const auto& [key, word] : model.values) {
    if (known.contains(key)) {
      const auto value = ValueOf(*model.line, word, scope, notes);
      if (!value.ok()) return value.status();
      values[key] = *value;
    } else if (ignored.contains(key)) {
      left_out.push_back(key);
    } else {
      return DeckError(model.line->Place(word.offset), fmt::format(".model {}: {} is not supported", name, key));
    }
  }
  if (!left_out.empty()) {
    notes.Add(fmt::format("{}: .model {}: {} {} ignored", model.line->Place(), name, fmt::join(left_out, ", "),
                          left_out.size() == 1 ? "is" : "are"));
  }
  return values;
}

// The exponential with a series resistance as lines between points. No current flows up to the voltage of the first.
DiodeModel ChordsOf(double saturation, double slope, double series, double current) {
  const auto volts = [&](double amperes) { return slope * std::log1p(amperes / saturation) + series * amperes; };
  DiodeModel diode;
  double before = 0, conductance = 0, forward = volts(current / 100);
  bool is_first = true;
  for (const double amperes : {current / 10, current, 10 * current}) {
    const double next = (amperes - before) / (volts(amperes) - forward);
    if (is_first) {
      diode.forward = forward;
      diode.on_resistance = 1 / next;
    } else if (next > conductance) {
      diode.further.push_back({forward, 1 / (next - conductance)});
    }
    is_first = false;
    conductance = next;
    before = amperes;
    forward = volts(amperes);
  }
  return diode;
}

}  // namespace

absl::StatusOr<DiodeModel> DiodeOf(const DeckModel& model, const std::string& name, double area,
                                   const DeckOptions& options, ParameterScope& scope, DeckNotes& notes) {
  static const std::set<std::string> kKnown = {"is", "js", "n", "rs", "bv", "vfwd", "vrev", "ron", "roff", "rrev"};
  static const std::set<std::string> kIgnored = {
      "cjo",  "cj0",  "cj",   "vj",   "pb",   "m",       "mj",         "tt",   "fc",   "eg",   "xti",   "kf",   "af",
      "ibv",  "nbv",  "ibvl", "nbvl", "tnom", "tref",    "isr",        "nr",   "ikf",  "ik",   "ikr",   "jsw",  "cjp",
      "cjsw", "php",  "mjsw", "fcs",  "trs1", "trs2",    "tbv1",       "tbv2", "tcv",  "tikf", "level", "vpk",  "ipk",
      "iave", "irms", "diss", "mfg",  "type", "epsilon", "revepsilon", "tcjo", "xtun", "trs",  "pj",    "area", "vp"};
  const auto found = ValuesOf(model, name, scope, notes, kKnown, kIgnored);
  if (!found.ok()) return found.status();
  const std::map<std::string, double>& values = *found;
  const auto at = [&values](const std::string& key, double otherwise) {
    const auto place = values.find(key);
    return place == values.end() ? otherwise : place->second;
  };
  DiodeModel diode;
  const bool is_linear = values.contains("vfwd") || values.contains("ron") || values.contains("roff");
  std::string rule;
  if (options.diode == DiodeRule::kIdeal) {
    rule = "ideal, as --diode ideal asks";
  } else if (is_linear) {
    diode = {.forward = at("vfwd", 0),
             .on_resistance = at("ron", 1) / area,
             .off_resistance = at("roff", std::numeric_limits<double>::infinity()) / area};
    rule = "from VFWD, RON and ROFF";
  } else {
    const double saturation = at("is", at("js", 1e-14)) * area, slope = at("n", 1) * kThermalVoltage;
    const double current = options.diode_current;
    if (!(saturation > 0) || !(slope > 0)) {
      return DeckError(model.line->Place(model.offset), fmt::format(".model {}: IS and N must be above 0", name));
    }
    const double series = at("rs", 0) / area;
    if (options.diode == DiodeRule::kPiecewise) {
      diode = ChordsOf(saturation, slope, series, current);
      rule = fmt::format("the first of three chords up to {:g} A", 10 * current);
    } else {
      diode.on_resistance = series + slope / current;
      diode.forward = std::max(0.0, slope * (std::log(current / saturation) - 1));
      rule = fmt::format("the tangent at {:g} A", current);
    }
  }
  const double breakdown = at("bv", at("vrev", 0));
  if (breakdown > 0 && std::isfinite(breakdown) && options.diode != DiodeRule::kIdeal) {
    diode.breakdown = breakdown;
    diode.breakdown_resistance = at("rrev", is_linear ? diode.on_resistance : at("rs", 0) / area);
  }
  std::string note = fmt::format(".model {}: a diode with a forward voltage of {:.6g} V and {:.6g} ohm ({})", name,
                                 diode.forward, diode.on_resistance, rule);
  if (diode.breakdown) {
    note += fmt::format(", breakdown at {:.6g} V with {:.6g} ohm", *diode.breakdown, diode.breakdown_resistance);
  }
  notes.Add(std::move(note));
  return diode;
}

absl::StatusOr<SwitchModel> SwitchOf(const DeckModel& model, const std::string& name, bool by_voltage,
                                     ParameterScope& scope, DeckNotes& notes) {
  const std::string threshold = by_voltage ? "vt" : "it", hysteresis = by_voltage ? "vh" : "ih";
  const auto values = ValuesOf(model, name, scope, notes, {"ron", "roff", threshold, hysteresis}, {});
  if (!values.ok()) return values.status();
  const auto value = [&](const std::string& key, double otherwise) {
    const auto place = values->find(key);
    return place == values->end() ? otherwise : place->second;
  };
  return SwitchModel{.threshold = value(threshold, 0),
                     .hysteresis = value(hysteresis, 0),
                     .on_resistance = value("ron", 1),
                     .off_resistance = value("roff", std::numeric_limits<double>::infinity())};
}

}  // namespace dlcs::client
