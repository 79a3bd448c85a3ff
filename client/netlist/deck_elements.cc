// SPDX-License-Identifier: Apache-2.0
// Elements of two nodes, and couplings.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <map>
#include <string_view>
#include <utility>

#include "client/netlist/deck_circuit.h"
#include "client/netlist/deck_models.h"
#include "client/netlist/deck_waveforms.h"
#include "client/netlist/spice_number.h"

namespace dlcs::client {
namespace {

// 1M is a milliohm, as in all SPICE, though people mean a megohm.
void NoteMilli(const DeckLine& line, const DeckWord& word, double value, DeckNotes& notes) {
  const std::size_t letter = word.text.find_first_not_of("0123456789.+-eE");
  if (word.is_expression || letter == std::string::npos || word.text[letter] != 'M') return;
  const std::string suffix = Lower(word.text.substr(letter));
  if (suffix.starts_with("meg") || suffix.starts_with("mil")) return;
  notes.Add(fmt::format("{}: {} is {:g} ohm: m is milli, and mega is meg", line.Place(word.offset), word.text, value));
}

}  // namespace

absl::Status DeckCircuit::AddPassive(const DeckFields& fields, const Instance& instance, Element element, char kind) {
  for (std::size_t k = 3; kind == 'r' && k < std::min<std::size_t>(fields.words.size(), 5); ++k) {
    if (!HasModel(instance, fields.words[k])) continue;
    const auto plain = WithoutModel(fields, k, instance);
    return plain.ok() ? AddPassive(*plain, instance, std::move(element), kind) : plain.status();
  }
  // PSpice writes two coefficients, as in TC=0,0.
  if (const auto tc = fields.named.find("tc"); tc != fields.named.end()) {
    const auto second = std::find_if(fields.words.begin(), fields.words.end(),
                                     [&](const DeckWord& word) { return word.offset > tc->second.offset; });
    if (second != fields.words.end() && !parts_.sets_temperature && ReadSpiceNumber(second->text)) {
      DeckFields plain = fields;
      plain.words.erase(plain.words.begin() + (second - fields.words.begin()));
      return AddPassive(plain, instance, std::move(element), kind);
    }
  }
  const std::string key(1, kind);
  const bool by_name = fields.named.contains(key);
  const std::string form =
      fmt::format("{}NAME NODE NODE VALUE{}", static_cast<char>(std::toupper(kind)), kind == 'r' ? "" : " [IC=VALUE]");
  if (absl::Status status = NeedWords(fields, by_name ? 3 : 4, form.c_str()); !status.ok()) return status;
  element.kind = kind == 'r' ? ElementKind::kResistor : kind == 'c' ? ElementKind::kCapacitor : ElementKind::kInductor;
  element.plus = NodeOf(instance, fields.words[1].text);
  element.minus = NodeOf(instance, fields.words[2].text);
  const auto value = Value(fields, by_name ? fields.named.at(key) : fields.words[3], instance);
  if (!value.ok()) return value.status();
  element.value = *value;
  const DeckWord& word = by_name ? fields.named.at(key) : fields.words[3];
  if (kind == 'r') NoteMilli(*fields.line, word, *value, notes_);
  if (!(element.value > 0)) {
    return DeckError(by_name ? fields.line->Place(fields.named.at(key).offset) : fields.Place(3),
                     fmt::format("{} has a value of {:g}; must be above 0{}", element.name, element.value,
                                 kind == 'r' ? " (a voltage source of 0 V is a short)" : ""));
  }
  std::set<std::string> known = {key, "m", "rser", "rpar", "lser", "cpar"};
  if (kind == 'r') known = {key, "m"};
  AddRatings(fields, kind, known);
  const auto parallel = NamedValue(fields, instance, "m", 1);
  if (!parallel.ok()) return parallel.status();
  element.value = kind == 'c' ? element.value * *parallel : element.value / *parallel;
  if (kind != 'r') {
    known.insert("ic");
    if (const auto ic = fields.named.find("ic"); ic != fields.named.end()) {
      const auto initial = Value(fields, ic->second, instance);
      if (!initial.ok()) return initial.status();
      element.initial = *initial;
    }
  }
  if (absl::Status status = RefuseRest(fields, by_name ? 3 : 4, known); !status.ok()) return status;
  if (absl::Status status = AddParasitics(fields, instance, *parallel, element); !status.ok()) return status;
  return Store(std::move(element), fields);
}

// A resistor whose model is word `k`, as one with a value.
absl::StatusOr<DeckFields> DeckCircuit::WithoutModel(const DeckFields& fields, std::size_t k,
                                                     const Instance& instance) {
  const auto model = ModelOf(fields, k, instance, {"r", "res"});
  if (!model.ok()) return model.status();
  const auto length = NamedValue(fields, instance, "l", 0), width = NamedValue(fields, instance, "w", 0);
  if (!length.ok()) return length.status();
  if (!width.ok()) return width.status();
  const bool has_value = fields.named.contains("r") || fields.words.size() > 4;
  const auto resistance = ResistanceOf(*model->model, fields.words[k].text, {has_value, *length, *width},
                                       parts_.sets_temperature, *model->scope, notes_);
  if (!resistance.ok()) return resistance.status();
  DeckFields plain = fields;
  plain.named.erase("l");
  plain.named.erase("w");
  if (has_value) {
    plain.words.erase(plain.words.begin() + static_cast<std::ptrdiff_t>(k));
  } else {
    plain.words[k] = {fmt::format("{:.17g}", *resistance), fields.words[k].offset, true};
  }
  return plain;
}

// Ignores the descriptions of LTspice's parts, and parameters of other analyses.
void DeckCircuit::AddRatings(const DeckFields& fields, char kind, std::set<std::string>& known) {
  static const std::map<char, std::set<std::string>> kRatings = {
      {'r', {"tol", "pwr", "mfg", "pn", "type", "ac", "tc", "tc1", "tc2", "noisy"}},
      {'c', {"v", "irms", "mtbf", "mfg", "pn", "type", "pppkg", "x2", "tc"}},
      {'l', {"ipk", "irms", "mfg", "pn", "type", "tc"}}};
  for (const std::string& rating : kRatings.at(kind)) {
    // A temperature other than the nominal one changes a resistance.
    const bool has_effect = rating.starts_with("tc") && parts_.sets_temperature;
    if (!fields.named.contains(rating) || has_effect) continue;
    known.insert(rating);
    notes_.Add(fmt::format("{}: {}: {} is ignored", fields.line->Place(), fields.words[0].text, rating));
  }
}

// What is in series with an element, and in parallel with both, as LTspice has it.
absl::Status DeckCircuit::AddParasitics(const DeckFields& fields, const Instance& instance, double parallel,
                                        Element& element) {
  const Index plus = element.plus;
  for (const std::string name : {"rser", "lser", "rpar", "cpar"}) {
    const auto given = fields.named.find(name);
    if (given == fields.named.end()) continue;
    const auto value = Value(fields, given->second, instance);
    if (!value.ok()) return value.status();
    if (*value == 0) continue;
    const bool is_series = name.ends_with("ser");
    const bool is_inductance = name[0] == 'l' && element.kind == ElementKind::kCapacitor;
    const bool is_supported = name[0] == 'r' || name[0] == 'c' || is_inductance;
    if (!(*value > 0) || !is_supported) {
      return DeckError(fields.line->Place(given->second.offset),
                       fmt::format("{}: {}={} is not supported here; write it as an element", fields.words[0].text,
                                   name, given->second.text));
    }
    Element part;
    part.name = fmt::format("{}#{}", element.name, name);
    part.place = element.place;
    part.kind = name[0] == 'r'   ? ElementKind::kResistor
                : name[0] == 'l' ? ElementKind::kInductor
                                 : ElementKind::kCapacitor;
    part.plus = is_series ? element.plus : plus;
    part.minus = element.minus;
    part.value = part.kind == ElementKind::kCapacitor ? *value * parallel : *value / parallel;
    if (is_series) {
      part.minus = static_cast<Index>(circuit_.nodes.size());
      circuit_.nodes.push_back(part.name);
      element.plus = part.minus;
    }
    if (absl::Status status = CheckCount(fields); !status.ok()) return status;
    if (absl::Status status = Store(std::move(part), fields); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status DeckCircuit::AddCoupling(const DeckFields& fields, const Instance& instance) {
  if (absl::Status status = NeedWords(fields, 4, "KNAME L1 L2 [L3 ...] VALUE"); !status.ok()) return status;
  if (absl::Status status = RefuseRest(fields, fields.words.size(), {}); !status.ok()) return status;
  const auto value = Value(fields, fields.words.back(), instance);
  if (!value.ok()) return value.status();
  for (std::size_t one = 1; one + 1 < fields.words.size(); ++one) {
    for (std::size_t other = one + 1; other + 1 < fields.words.size(); ++other) {
      pending_couplings_.push_back({instance.prefix + fields.words[0].text, instance.prefix + fields.words[one].text,
                                    instance.prefix + fields.words[other].text, *value, fields.Place(one),
                                    fields.Place(other), fields.Place(fields.words.size() - 1)});
    }
  }
  return absl::OkStatus();
}

absl::Status DeckCircuit::AddSource(const DeckFields& fields, const Instance& instance, Element element, char kind) {
  if (absl::Status status = NeedWords(fields, 3, "VNAME NODE NODE VALUE"); !status.ok()) return status;
  element.kind = kind == 'v' ? ElementKind::kVoltageSource : ElementKind::kCurrentSource;
  element.plus = NodeOf(instance, fields.words[1].text);
  element.minus = NodeOf(instance, fields.words[2].text);
  element.source = ConstantWave{0};
  std::size_t k = 3;
  bool has_function = false, has_value = false;
  const auto is_number = [&fields](std::size_t at) {
    return at < fields.words.size() && (fields.words[at].is_expression || ReadSpiceNumber(fields.words[at].text));
  };
  while (k < fields.words.size()) {
    const std::string word = fields.words[k].is_expression ? "" : Lower(fields.words[k].text);
    if (word == "ac") {
      // Of another analysis: magnitude and phase.
      ++k;
      for (int part = 0; part < 2 && is_number(k); ++part) ++k;
      continue;
    }
    const bool is_named = word == "dc";
    if (is_named) {
      if (++k == fields.words.size()) return DeckError(fields.Place(k), "DC needs a value");
      if (!fields.words[k].is_expression && IsWaveform(Lower(fields.words[k].text))) continue;  // as xschem writes it
    } else if (!word.empty() && std::isalpha(static_cast<unsigned char>(word[0])) != 0 && word != "(") {
      if (has_function) return DeckError(fields.Place(k), fmt::format("{} has two functions", element.name));
      const auto wave =
          ReadWaveform(fields, k, {step_, circuit_.horizon, options_.ideal_edges}, *instance.scope, notes_);
      if (!wave.ok()) return wave.status();
      element.source = *wave;
      has_function = true;
      continue;
    }
    const auto value = Value(fields, fields.words[k], instance);
    if (!value.ok()) return value.status();
    if (has_value || (has_function && !is_named)) {
      return DeckError(fields.Place(k),
                       fmt::format("{}: {} is a second value; a source is written with at most one value, one function "
                                   "and AC with its magnitude and phase{}",
                                   element.name, fields.words[k].text, HintOnBlank(fields, k)));
    }
    has_value = true;
    if (!has_function) element.source = ConstantWave{*value};
    ++k;
  }
  // ngspice reads = as a blank, as in DC=5.
  const auto dc = fields.named.find("dc");
  const bool uses_dc = dc != fields.named.end() && !has_value;
  if (uses_dc) {
    const auto value = Value(fields, dc->second, instance);
    if (!value.ok()) return value.status();
    if (!has_function) element.source = ConstantWave{*value};
  }
  std::set<std::string> known = {"rser"};
  if (!fields.named.contains("dc") || uses_dc) known.insert({"dc", "ac"});
  if (std::holds_alternative<PiecewiseLinearWave>(element.source)) known.insert({"r", "td"});
  if (absl::Status status = RefuseRest(fields, fields.words.size(), known); !status.ok()) return status;
  if (absl::Status status = AddParasitics(fields, instance, 1, element); !status.ok()) return status;
  if (const std::string fault = FaultOf(element.source); !fault.empty()) {
    return DeckError(fields.line->Place(), fmt::format("{}: {}", element.name, fault));
  }
  if (turns_sources_on_ && instance.depth == 0) element.source = TurnedOn(element.source, circuit_.horizon);
  return Store(std::move(element), fields);
}

bool DeckCircuit::HasModel(const Instance& instance, const DeckWord& word) const {
  for (const Instance* place = &instance; place != nullptr && !word.is_expression; place = place->around) {
    if (place->body->models.contains(Lower(word.text))) return true;
  }
  return false;
}

absl::StatusOr<DeckCircuit::FoundModel> DeckCircuit::ModelOf(const DeckFields& fields, std::size_t k,
                                                             const Instance& instance,
                                                             const std::set<std::string>& types) {
  for (const Instance* place = &instance; place != nullptr; place = place->around) {
    const auto found = place->body->models.find(Lower(fields.words[k].text));
    if (found == place->body->models.end()) continue;
    const DeckModel& model = found->second;
    if (types.contains(model.type)) return FoundModel{&model, place->scope};
    return DeckError(fields.Place(k), fmt::format("{}: .model {} is of type {}; must be {}", fields.words[0].text,
                                                  fields.words[k].text, model.type, fmt::join(types, " or ")));
  }
  return DeckError(fields.Place(k), fmt::format("{}: there is no .model {}; write it, or .include the file that has it",
                                                fields.words[0].text, fields.words[k].text));
}

absl::Status DeckCircuit::AddDiode(const DeckFields& fields, const Instance& instance, Element element) {
  if (absl::Status status = NeedWords(fields, 4, "DNAME ANODE CATHODE MODEL [AREA]"); !status.ok()) return status;
  element.kind = ElementKind::kDiode;
  element.plus = NodeOf(instance, fields.words[1].text);
  element.minus = NodeOf(instance, fields.words[2].text);
  const auto model = ModelOf(fields, 3, instance, {"d"});
  if (!model.ok()) return model.status();
  double area = 1;
  std::size_t used = 4;
  if (fields.words.size() > used && Lower(fields.words[used].text) != "off") {
    const auto given = Value(fields, fields.words[used], instance);
    if (!given.ok()) return given.status();
    area = *given;
    ++used;
  } else if (const auto named = fields.named.find("area"); named != fields.named.end()) {
    const auto given = Value(fields, named->second, instance);
    if (!given.ok()) return given.status();
    area = *given;
  }
  const auto parallel = NamedValue(fields, instance, "m", 1);
  if (!parallel.ok()) return parallel.status();
  area *= *parallel;
  if (!(area > 0))
    return DeckError(fields.Place(4), fmt::format("{}: an area of {:g}; must be above 0", element.name, area));
  if (fields.words.size() > used && Lower(fields.words[used].text) == "off") ++used;
  std::set<std::string> known = {"area", "m"};
  // A diode without capacitance has no initial voltage.
  for (const std::string name : {"ic", "temp", "dtemp"}) {
    if (!fields.named.contains(name)) continue;
    known.insert(name);
    notes_.Add(fmt::format("{}: {}: {} is ignored", fields.line->Place(), fields.words[0].text, name));
  }
  if (absl::Status status = RefuseRest(fields, used, known); !status.ok()) return status;
  const auto diode = DiodeOf(*model->model, fields.words[3].text, area, options_, *model->scope, notes_);
  if (!diode.ok()) return diode.status();
  element.diode = *diode;
  return Store(std::move(element), fields);
}

absl::Status DeckCircuit::AddSwitch(const DeckFields& fields, const Instance& instance, Element element, char kind) {
  const bool by_voltage = kind == 's';
  const std::size_t at = by_voltage ? 5 : 4;
  const char* form =
      by_voltage ? "SNAME NODE NODE CONTROL+ CONTROL- MODEL [ON|OFF]" : "WNAME NODE NODE VNAME MODEL [ON|OFF]";
  if (absl::Status status = NeedWords(fields, at + 1, form); !status.ok()) return status;
  element.kind = ElementKind::kSwitch;
  element.plus = NodeOf(instance, fields.words[1].text);
  element.minus = NodeOf(instance, fields.words[2].text);
  const auto model =
      ModelOf(fields, at, instance,
              by_voltage ? std::set<std::string>{"sw", "vswitch"} : std::set<std::string>{"csw", "iswitch"});
  if (!model.ok()) return model.status();
  const auto made = SwitchOf(*model->model, fields.words[at].text, by_voltage, *model->scope, notes_);
  if (!made.ok()) return made.status();
  element.switching = made->switching;
  const double factor = made->closes_below ? -1 : 1;
  if (by_voltage) {
    element.controls = {{.factor = factor,
                         .plus = NodeOf(instance, fields.words[3].text),
                         .minus = NodeOf(instance, fields.words[4].text)}};
  } else {
    PendControl(instance, fields, 3, factor);
  }
  std::size_t used = at + 1;
  if (fields.words.size() > used) {
    const std::string word = Lower(fields.words[used].text);
    if (word == "on" || word == "off") {
      element.switching.starts_closed = (word == "on") != made->closes_below;
      ++used;
    }
  }
  if (absl::Status status = RefuseRest(fields, used, {}); !status.ok()) return status;
  return Store(std::move(element), fields);
}

absl::StatusOr<double> DeckCircuit::NamedValue(const DeckFields& fields, const Instance& instance,
                                               const std::string& name, double otherwise) {
  const auto given = fields.named.find(name);
  if (given == fields.named.end()) return otherwise;
  const auto value = Value(fields, given->second, instance);
  if (value.ok() && !(*value > 0)) {
    return DeckError(fields.line->Place(given->second.offset),
                     fmt::format("{}: {}={:g}; must be above 0", fields.words[0].text, name, *value));
  }
  return value;
}

// A transistor is a switch whose gate takes no current, with its body diode. The bulk must be at the source.
absl::Status DeckCircuit::AddTransistor(const DeckFields& fields, const Instance& instance, Element element) {
  const char* form = "MNAME DRAIN GATE SOURCE [BULK] MODEL";
  if (absl::Status status = NeedWords(fields, 5, form); !status.ok()) return status;
  const bool has_bulk = fields.words.size() > 5 && Lower(fields.words[5].text) != "off";
  const std::size_t at = has_bulk ? 5 : 4;
  const auto model = ModelOf(fields, at, instance, {"nmos", "pmos", "vdmos"});
  if (!model.ok()) return model.status();
  const Index drain = NodeOf(instance, fields.words[1].text), gate = NodeOf(instance, fields.words[2].text),
              source = NodeOf(instance, fields.words[3].text);
  if (has_bulk && NodeOf(instance, fields.words[4].text) != source) {
    return DeckError(fields.Place(4),
                     fmt::format("{}: the bulk {} is not at the source {}, which is not supported; a power MOSFET has "
                                 "them together, others are written as a switch S with diodes D",
                                 element.name, fields.words[4].text, fields.words[3].text));
  }
  TransistorSize size;
  const auto width = NamedValue(fields, instance, "w", 1), length = NamedValue(fields, instance, "l", 1),
             parallel = NamedValue(fields, instance, "m", 1);
  for (const auto* value : {&width, &length, &parallel}) {
    if (!value->ok()) return value->status();
  }
  if (fields.named.contains("w") != fields.named.contains("l")) {
    return DeckError(fields.line->Place(), fmt::format("{}: W and L must be given together", element.name));
  }
  size = {.width_by_length = *width / *length, .parallel = *parallel};
  std::size_t used = at + 1;
  if (fields.words.size() > used && Lower(fields.words[used].text) == "off") ++used;
  static const std::set<std::string> kIgnored = {"ad", "as", "pd", "ps", "nrd", "nrs", "temp", "dtemp"};
  std::set<std::string> known = {"w", "l", "m"};
  for (const std::string& name : kIgnored) {
    if (!fields.named.contains(name)) continue;
    known.insert(name);
    notes_.Add(fmt::format("{}: {}: {} is ignored", fields.line->Place(), fields.words[0].text, name));
  }
  if (absl::Status status = RefuseRest(fields, used, known); !status.ok()) return status;
  const auto made = TransistorOf(*model->model, fields.words[at].text, size, options_, *model->scope, notes_);
  if (!made.ok()) return made.status();
  // From where its body diode blocks to where it conducts: drain to source, or source to drain of a P-channel. Its
  // current is that into the drain.
  element.kind = ElementKind::kSwitch;
  element.plus = drain;
  element.minus = source;
  element.switching = made->switching;
  element.body_diode = made->body_diode;
  element.controls = {{.factor = made->is_p ? -1.0 : 1.0, .plus = gate, .minus = source}};
  element.body_points_to_minus = made->is_p;
  return Store(std::move(element), fields);
}

}  // namespace dlcs::client
