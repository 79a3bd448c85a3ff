// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_models.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "proto/shared/nearest_name.h"

namespace dlcs::client {
namespace {

constexpr double kThermalVoltage = 1.380649e-23 * 300.15 / 1.602176634e-19;  // at 27 degrees, as SPICE has it

// The numbers of a model by their names.
class ModelValues {
 public:
  double At(const std::string& key, double otherwise) const {
    const auto place = values_.find(key);
    return place == values_.end() ? otherwise : place->second;
  }
  bool Has(const std::string& key) const { return values_.contains(key); }
  void Set(const std::string& key, double value) { values_[key] = value; }

 private:
  std::map<std::string, double> values_;
};

// The numbers of `model`: each name must be in `known` or in `ignored`.
absl::StatusOr<ModelValues> ValuesOf(const DeckModel& model, const std::string& name, ParameterScope& scope,
                                     DeckNotes& notes, const std::set<std::string>& known,
                                     const std::set<std::string>& ignored) {
  ModelValues values;
  std::vector<std::string> left_out;
  for (const auto& [key, word] : model.values) {
    if (known.contains(key)) {
      const auto value = ValueOf(*model.line, word, scope, notes);
      if (!value.ok()) return value.status();
      values.Set(key, *value);
    } else if (ignored.contains(key)) {
      left_out.push_back(key);
    } else {
      return DeckError(model.line->Place(word.offset),
                       fmt::format(".model {}: {} is not supported{}", name, key,
                                   DidYouMean(NearestName(key, {known.begin(), known.end()}))));
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

// The exponential by the rule of `options`, and that rule as text.
std::pair<DiodeModel, std::string> FromExponential(double saturation, double slope, double series,
                                                   const DeckOptions& options) {
  if (options.diode == DiodeRule::kIdeal) return {DiodeModel{}, "ideal, as --diode ideal asks"};
  const double current = options.diode_current;
  if (options.diode == DiodeRule::kPiecewise) {
    return {ChordsOf(saturation, slope, series, current),
            fmt::format("the first of three chords up to {:g} A", 10 * current)};
  }
  return {{.forward = std::max(0.0, slope * (std::log(current / saturation) - 1)),
           .on_resistance = series + slope / current},
          fmt::format("the tangent at {:g} A", current)};
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
  const auto values = ValuesOf(model, name, scope, notes, kKnown, kIgnored);
  if (!values.ok()) return values.status();
  const auto at = [&values](const std::string& key, double otherwise) { return values->At(key, otherwise); };
  DiodeModel diode;
  const bool is_linear = values->Has("vfwd") || values->Has("ron") || values->Has("roff");
  std::string rule;
  if (options.diode == DiodeRule::kIdeal) {
    rule = "ideal, as --diode ideal asks";
  } else if (is_linear) {
    diode = {.forward = at("vfwd", 0),
             .on_resistance = at("ron", 1) / area,
             .off_resistance = at("roff", std::numeric_limits<double>::infinity()) / area};
    rule = "from VFWD, RON and ROFF";
    for (const char* exponential : {"is", "js", "n", "rs"}) {
      if (values->Has(exponential)) rule = "from VFWD, RON and ROFF; IS, N and RS are ignored, as in LTspice";
    }
  } else {
    const double saturation = at("is", at("js", 1e-14)) * area, slope = at("n", 1) * kThermalVoltage;
    if (!(saturation > 0) || !(slope > 0)) {
      return DeckError(model.line->Place(model.offset), fmt::format(".model {}: IS and N must be above 0", name));
    }
    std::tie(diode, rule) = FromExponential(saturation, slope, at("rs", 0) / area, options);
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

absl::StatusOr<SwitchKind> SwitchOf(const DeckModel& model, const std::string& name, bool by_voltage,
                                    ParameterScope& scope, DeckNotes& notes) {
  const bool is_smooth = model.type == "vswitch" || model.type == "iswitch";
  const std::string threshold = by_voltage ? "vt" : "it", hysteresis = by_voltage ? "vh" : "ih",
                    on = by_voltage ? "von" : "ion", off = by_voltage ? "voff" : "ioff";
  const std::set<std::string> levels = is_smooth ? std::set{on, off} : std::set{threshold, hysteresis};
  std::set<std::string> known = {"ron", "roff"};
  known.insert(levels.begin(), levels.end());
  const auto values = ValuesOf(model, name, scope, notes, known, {});
  if (!values.ok()) return values.status();
  SwitchKind made;
  SwitchModel& switching = made.switching;
  switching.on_resistance = values->At("ron", 1);
  switching.off_resistance = values->At("roff", is_smooth ? 1e6 : std::numeric_limits<double>::infinity());
  double half_band = 0;
  if (is_smooth) {
    const double closed = values->At(on, by_voltage ? 1 : 1e-3), open = values->At(off, 0);
    switching.threshold = (closed + open) / 2;
    half_band = std::abs(closed - open) / 2;
    made.closes_below = closed < open;
  } else {
    switching.threshold = values->At(threshold, 0);
    switching.hysteresis = values->At(hysteresis, 0);
    half_band = std::max(0.0, -switching.hysteresis);
    switching.hysteresis = std::max(0.0, switching.hysteresis);
  }
  if (half_band > 0) {
    notes.Add(
        fmt::format(".model {}: a resistance that changes smoothly within {:g} of {:g} is taken as a switch at {:g}",
                    name, half_band, switching.threshold, switching.threshold));
  }
  if (switching.on_resistance > switching.off_resistance) {
    std::swap(switching.on_resistance, switching.off_resistance);
    made.closes_below = !made.closes_below;
  }
  if (made.closes_below) {
    notes.Add(fmt::format(".model {}: closed below {:g}, open above", name, switching.threshold));
    switching.threshold = -switching.threshold;
    switching.starts_closed = true;
  }
  return made;
}

absl::StatusOr<TransistorModel> TransistorOf(const DeckModel& model, const std::string& name,
                                             const TransistorSize& size, const DeckOptions& options,
                                             ParameterScope& scope, DeckNotes& notes) {
  static const std::set<std::string> kKnown = {"vto", "vt0", "vth0", "kp",  "rd",    "rs",    "rb",   "is",
                                               "n",   "bv",  "rds",  "ron", "level", "pchan", "nchan"};
  static const std::set<std::string> kIgnored = {
      "lambda", "phi",    "gamma", "tox",    "cgso",  "cgdo",  "cgbo",        "cj",          "cjsw",     "mj",
      "mjsw",   "js",     "pb",    "ld",     "uo",    "u0",    "nsub",        "nss",         "nfs",      "tpg",
      "xj",     "vmax",   "delta", "eta",    "theta", "kappa", "kf",          "af",          "fc",       "tnom",
      "cbd",    "cbs",    "rsh",   "rg",     "qg",    "vds",   "mfg",         "mtriode",     "subthres", "ksubthres",
      "cgdmax", "cgdmin", "cgs",   "cjo",    "vj",    "m",     "tt",          "eg",          "xti",      "ibv",
      "nbv",    "a",      "rthjc", "lambda", "bex",   "vtotc", "tksubthres1", "tksubthres2", "texp0",    "texp1",
      "trb1",   "trs1",   "trd1",  "trg1",   "w",     "l"};
  const auto values = ValuesOf(model, name, scope, notes, kKnown, kIgnored);
  if (!values.ok()) return values.status();
  const auto at = [&values](const std::string& key, double otherwise) { return values->At(key, otherwise); };
  const auto fail = [&](const std::string& why) {
    return DeckError(model.line->Place(model.offset), fmt::format(".model {}: {}", name, why));
  };
  const bool is_power = model.type == "vdmos";
  if (!is_power && at("level", 1) > 3) {
    return fail(fmt::format(
        "LEVEL={:g} is not supported: of levels 1 to 3 the threshold and the on-resistance are known", at("level", 1)));
  }
  constexpr double kGate = 10;  // V
  TransistorModel made;
  made.is_p = model.type == "pmos" || (is_power && values->Has("pchan"));
  const double given = at("vto", at("vt0", at("vth0", 0)));
  const double threshold = made.is_p ? -given : given;
  if (!(threshold < kGate)) {
    return fail(fmt::format("a threshold of {:g} V; its on-resistance is that at {:g} V", given, kGate));
  }
  const double transconductance = at("kp", is_power ? 1 : 2e-5) * size.width_by_length;
  const double saturation = at("is", 1e-14), slope = at("n", 1) * kThermalVoltage;
  if (!(transconductance > 0) || !(saturation > 0) || !(slope > 0)) return fail("KP, IS and N must be above 0");
  const double ohms = at("rd", 0) + at("rs", 0) + 1 / (transconductance * (kGate - threshold));
  made.switching = {.threshold = threshold,
                    .on_resistance = at("ron", ohms) / size.parallel,
                    .off_resistance = at("rds", std::numeric_limits<double>::infinity()) / size.parallel,
                    .is_transistor = true};
  std::string rule;
  std::tie(made.body_diode, rule) =
      FromExponential(saturation * size.parallel, slope, at("rb", 0) / size.parallel, options);
  if (const double breakdown = at("bv", 0); breakdown > 0 && std::isfinite(breakdown)) {
    made.body_diode.breakdown = breakdown;
    made.body_diode.breakdown_resistance = at("rb", 0) / size.parallel;
  }
  notes.Add(fmt::format(
      ".model {}: a switch, closed where the gate is more than {:g} V {} the source, with {:.6g} ohm ({}), and a body "
      "diode with {:.6g} V and {:.6g} ohm ({})",
      name, threshold, made.is_p ? "below" : "above", made.switching.on_resistance,
      values->Has("ron") ? "RON" : fmt::format("RD + RS + the channel at {:g} V", kGate), made.body_diode.forward,
      made.body_diode.on_resistance, rule));
  return made;
}

absl::StatusOr<double> ResistanceOf(const DeckModel& model, const std::string& name, const ResistorLine& line,
                                    bool sets_temperature, ParameterScope& scope, DeckNotes& notes) {
  static const std::set<std::string> kKnown = {"r", "rsh", "l", "w", "defw", "narrow", "short"};
  std::set<std::string> ignored = {"kf", "af", "lf", "wf", "ef", "bv_max"};
  if (!sets_temperature) ignored.insert({"tc1", "tc2", "tce"});
  const auto values = ValuesOf(model, name, scope, notes, kKnown, ignored);
  if (!values.ok()) return values.status();
  const auto at = [&values](const std::string& key, double otherwise) { return values->At(key, otherwise); };
  const auto fail = [&](const char* why) {
    return DeckError(model.line->Place(model.offset), fmt::format(".model {}: {}", name, why));
  };
  if (line.has_value) {
    if (at("r", 1) == 1) return 0;
    return fail("the line of the resistor has a value too, which counts alone in ngspice and times R in PSpice");
  }
  if (at("narrow", 0) != 0 || at("short", 0) != 0) {
    return fail(
        "NARROW and SHORT are subtracted once by some versions of ngspice and twice by others; give the "
        "resistance");
  }
  const double sheet = at("rsh", 0);
  if (sheet == 0 && values->Has("r")) return at("r", 0);
  const double length = line.length > 0 ? line.length : at("l", 0);
  const double width = line.width > 0 ? line.width : at("w", at("defw", 0));
  if (!(sheet > 0) || !(length > 0) || !(width > 0)) return fail("needs R, or RSH with L and W, which must be above 0");
  return sheet * length / width;
}

}  // namespace dlcs::client
