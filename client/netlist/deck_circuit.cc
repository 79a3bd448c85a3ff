// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_circuit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include "proto/shared/nearest_name.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// Dense matrices of the formulation grow with the square.
constexpr std::size_t kMaxElements = 2000;
// That are kept for messages.
constexpr std::size_t kMaxPorts = 20'000;

std::string NotSupported(const std::string& name, char kind) {
  switch (kind) {
    case 'q':
    case 'j':
    case 'z':
      return fmt::format(
          "{}: of transistors only MOSFETs (M) are read, as switches. Replace one that is turned on and off by a "
          "switch S; a bipolar one and an IGBT conduct in one direction only: by a switch in series with a diode whose "
          "VFWD is its saturation voltage",
          name);
    case 't':
    case 'o':
    case 'u':
      return fmt::format("{}: transmission lines are not supported", name);
    case 'a':
      return fmt::format("{}: code models are not supported", name);
    default:
      return fmt::format("{}: an element that begins with {} is not known", name, name[0]);
  }
}

bool HasOwnParameter(const DeckBody& body, const std::string& name) {
  for (const DeckLine* line : body.parameters) {
    const auto definitions = DefinitionsOf(*line, line->text.find_first_of(" \t"));
    if (!definitions.ok()) continue;
    for (const Definition& definition : *definitions) {
      if (Lower(definition.name) == name) return true;
    }
  }
  return false;
}

// Whether `name` is a word of `text`.
bool HasWord(const std::string& text, const std::string& name) {
  const std::string lower = Lower(text);
  const auto is_part = [&lower](std::size_t at) {
    return at < lower.size() && (std::isalnum(static_cast<unsigned char>(lower[at])) != 0 || lower[at] == '_');
  };
  for (std::size_t at = lower.find(name); at != std::string::npos; at = lower.find(name, at + 1)) {
    if ((at == 0 || !is_part(at - 1)) && !is_part(at + name.size())) return true;
  }
  return false;
}

// Whether an expression of the subcircuit has a parameter of this name, which it need not declare in LTspice.
bool UsesParameter(const DeckBody& body, const std::string& name) {
  const auto uses = [&name](const DeckLine* line) {
    if (Lower(line->text)[0] == 'b' || line->text[0] == '.') return HasWord(line->text, name);
    const std::vector<DeckWord> words = WordsOf(*line);
    return std::any_of(words.begin(), words.end(),
                       [&name](const DeckWord& word) { return word.is_expression && HasWord(word.text, name); });
  };
  return std::any_of(body.elements.begin(), body.elements.end(), uses) ||
         std::any_of(body.parameters.begin(), body.parameters.end(), uses);
}

}  // namespace

absl::Status DeckCircuit::AddAll(ParameterScope& global, double step, double stop) {
  step_ = step;
  global_ = &global;
  circuit_.horizon = stop;
  const Instance top{.prefix = "", .body = &parts_.top, .scope = &global, .nodes = {}, .around = nullptr, .depth = 0};
  if (absl::Status status = Expand(top); !status.ok() || only_voltage_sources_) return status;
  if (circuit_.elements.empty()) return absl::InvalidArgumentError("the deck has no element");
  if (absl::Status status = ResolveControls(); !status.ok()) return status;
  return ResolveCouplings();
}

Index DeckCircuit::NodeNamed(const std::string& lower) const {
  const auto found = node_names_.find(lower);
  return found == node_names_.end() ? -1 : found->second;
}

std::string DeckCircuit::HintOnNode(const std::string& lower) const {
  constexpr std::size_t kLongestName = 256;
  constexpr std::size_t kMaxListed = 5;
  if (lower.size() > kLongestName) return "";
  if (const auto port = ports_.find(lower); port != ports_.end()) {
    const std::string& node = circuit_.nodes[AsSize(port->second)];
    return fmt::format("; it is a port of a subcircuit, which is at the node {} outside", node);
  }
  const auto is_own = [](const std::string& name) { return name.find('#') == std::string::npos; };
  std::vector<std::string> names;
  std::copy_if(circuit_.nodes.begin() + 1, circuit_.nodes.end(), std::back_inserter(names), is_own);
  if (const auto nearest = NearestName(lower, names)) return DidYouMean(nearest);
  const std::string prefix = lower.substr(0, lower.rfind('.') + 1);
  std::erase_if(names, [&](const std::string& name) { return prefix.empty() || !Lower(name).starts_with(prefix); });
  return names.empty() ? "" : "; the subcircuit has " + JoinFirst(names, kMaxListed);
}

Index DeckCircuit::ElementNamed(const std::string& lower) const {
  const auto found = element_names_.find(lower);
  return found == element_names_.end() ? -1 : found->second;
}

Index DeckCircuit::NodeOf(const Instance& instance, const std::string& name) {
  const std::string lower = Lower(name);
  if (lower == "0" || lower == "gnd") {
    node_names_.emplace(lower, 0);
    return 0;
  }
  if (const auto port = instance.nodes.find(lower); port != instance.nodes.end()) return port->second;
  const bool is_global = parts_.globals.contains(lower);
  const std::string full = is_global ? lower : Lower(instance.prefix) + lower;
  const auto [found, is_new] = node_names_.emplace(full, static_cast<Index>(circuit_.nodes.size()));
  if (is_new) circuit_.nodes.push_back(is_global ? name : instance.prefix + name);
  return found->second;
}

absl::Status DeckCircuit::Expand(const Instance& instance) {
  for (const DeckLine* line : instance.body->elements) {
    if (absl::Status status = AddElement(*line, instance); !status.ok()) return status;
  }
  for (const DeckLine* line : instance.body->initial) {
    if (only_voltage_sources_) break;
    if (absl::Status status = SetInitial(*line, instance); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// V(node)=volts and I(inductor)=amperes.
absl::Status DeckCircuit::SetInitial(const DeckLine& line, const Instance& instance) {
  const std::vector<DeckWord> words = WordsOf(line);
  for (std::size_t k = 1; k < words.size(); k += 6) {
    const bool fits =
        k + 5 < words.size() && words[k + 1].text == "(" && words[k + 3].text == ")" && words[k + 4].text == "=";
    const std::string kind = Lower(words[k].text);
    if (!fits || (kind != "v" && kind != "i")) {
      return DeckError(line.Place(words[k].offset), ".ic is written .ic V(node)=value");
    }
    const auto value = ValueOf(line, words[k + 5], *instance.scope, notes_);
    if (!value.ok()) return value.status();
    const std::string name = Lower(words[k + 2].text), full = Lower(instance.prefix) + name;
    if (kind == "i") {
      const Index element = ElementNamed(full);
      if (element < 0 || circuit_.elements[AsSize(element)].kind != ElementKind::kInductor) {
        return DeckError(line.Place(words[k + 2].offset), fmt::format("\"{}\" is not an inductor", words[k + 2].text));
      }
      if (!circuit_.uses_initial_conditions) {
        return DeckError(line.Place(words[k].offset), ".ic of a current is supported with UIC only");
      }
      circuit_.elements[AsSize(element)].initial = *value;
      continue;
    }
    const auto port = instance.nodes.find(name);
    const bool is_global = parts_.globals.contains(name);
    const Index node = port != instance.nodes.end() ? port->second : NodeNamed(is_global ? name : full);
    if (node < 0) {
      return DeckError(line.Place(words[k + 2].offset), fmt::format("\"{}\" is not a node", words[k + 2].text));
    }
    if (node == 0) return DeckError(line.Place(words[k + 2].offset), "ground is at 0 V");
    circuit_.node_voltages.push_back({node, *value});
  }
  return absl::OkStatus();
}

absl::Status DeckCircuit::AddElement(const DeckLine& line, const Instance& instance) {
  if (only_voltage_sources_ && std::string_view("vVxX").find(line.text[0]) == std::string_view::npos) {
    return absl::OkStatus();
  }
  auto read = FieldsOf(line);
  if (!read.ok()) return read.status();
  const DeckFields& fields = *read;
  if (absl::Status status = CheckCount(fields); !status.ok()) return status;
  Element element;
  element.name = instance.prefix + fields.words[0].text;
  element.place = line.Place();
  const char kind = Lower(fields.words[0].text)[0];
  switch (kind) {
    case 'r':
    case 'c':
    case 'l':
      return AddPassive(fields, instance, std::move(element), kind);
    case 'k':
      return AddCoupling(fields, instance);
    case 'v':
    case 'i':
      return AddSource(fields, instance, std::move(element), kind);
    case 'e':
    case 'f':
    case 'g':
    case 'h':
      return AddControlled(fields, instance, std::move(element), kind);
    case 'b':
      return AddBehavioral(fields, instance, std::move(element));
    case 'd':
      return AddDiode(fields, instance, std::move(element));
    case 's':
    case 'w':
      return AddSwitch(fields, instance, std::move(element), kind);
    case 'm':
      return AddTransistor(fields, instance, std::move(element));
    case 'x':
      return AddInstance(fields, instance);
    default:
      return DeckError(fields.Place(0), NotSupported(fields.words[0].text, kind));
  }
}

absl::Status DeckCircuit::CheckCount(const DeckFields& fields) const {
  if (circuit_.elements.size() < kMaxElements) return absl::OkStatus();
  return DeckError(fields.line->Place(), fmt::format("more than {} elements after expansion", kMaxElements));
}

absl::Status DeckCircuit::Store(Element element, const DeckFields& fields) {
  const std::string lower = Lower(element.name);
  const auto [other, is_new] = element_names_.emplace(lower, static_cast<Index>(circuit_.elements.size()));
  if (!is_new) {
    return DeckError(fields.Place(0), fmt::format("{} is there twice, first at {}", element.name,
                                                  circuit_.elements[AsSize(other->second)].place));
  }
  circuit_.elements.push_back(std::move(element));
  return absl::OkStatus();
}

void DeckCircuit::PendControl(const Instance& instance, const DeckFields& fields, std::size_t k, double factor) {
  pending_controls_.push_back({static_cast<Index>(circuit_.elements.size()), factor,
                               instance.prefix + fields.words[k].text, fields.Place(k), /*by_any=*/false});
}

absl::Status DeckCircuit::AddInstance(const DeckFields& fields, const Instance& instance) {
  if (absl::Status status = NeedWords(fields, 2, "XNAME NODE ... SUBCKT [NAME=VALUE ...]"); !status.ok()) return status;
  std::size_t last = fields.words.size() - 1;
  if (const std::string word = Lower(fields.words[last].text); word == "params:" || word == "params") --last;
  const std::string name = Lower(fields.words[last].text);
  const DeckSubcircuit* found = nullptr;
  const Instance* home = &instance;
  for (; home != nullptr; home = home->around) {
    const auto place = home->body->subcircuits.find(name);
    if (place == home->body->subcircuits.end()) continue;
    found = &place->second;
    break;
  }
  if (found == nullptr) {
    return DeckError(fields.Place(last),
                     fmt::format("{}: there is no .subckt {}; write it, or .include the file that has it",
                                 fields.words[0].text, fields.words[last].text));
  }
  if (instance.depth >= kMaxSubcircuitDepth) {
    return DeckError(fields.Place(0), fmt::format("{}: subcircuits are nested deeper than {}; does {} contain itself?",
                                                  fields.words[0].text, kMaxSubcircuitDepth, found->name));
  }
  if (const std::size_t nodes = last - 1, ports = found->ports.size(); nodes != ports) {
    return DeckError(fields.Place(0),
                     fmt::format("{} has {} node{}, but .subckt {} needs {}, in this order: {}", fields.words[0].text,
                                 nodes, nodes == 1 ? "" : "s", found->name, ports, fmt::join(found->ports, " ")));
  }
  Instance inner{.prefix = instance.prefix + fields.words[0].text + ".",
                 .body = found->body.get(),
                 .scope = nullptr,
                 .nodes = {},
                 .around = home,
                 .depth = instance.depth + 1};
  for (std::size_t k = 0; k < found->ports.size(); ++k) {
    inner.nodes[found->ports[k]] = NodeOf(instance, fields.words[k + 1].text);
    if (ports_.size() < kMaxPorts) ports_.emplace(Lower(inner.prefix) + found->ports[k], inner.nodes[found->ports[k]]);
  }
  ParameterScope scope(home->scope);
  inner.scope = &scope;
  const auto given = GiveParameters(fields, instance, *found, scope);
  if (!given.ok()) return given.status();
  if (absl::Status status = DefineParameters(found->body->parameters, *given, scope); !status.ok()) return status;
  if (expanded_++ > kMaxElements)
    return DeckError(fields.Place(0), fmt::format("more than {} subcircuits after expansion", kMaxElements));
  return Expand(inner);
}

absl::StatusOr<std::set<std::string>> DeckCircuit::GiveParameters(const DeckFields& fields, const Instance& instance,
                                                                  const DeckSubcircuit& subcircuit,
                                                                  ParameterScope& scope) {
  std::vector<std::string> own;
  std::set<std::string> given;
  for (std::size_t k = 0; k < subcircuit.defaults.size(); k += 2) own.push_back(Lower(subcircuit.defaults[k].text));
  for (const auto& [name, word] : fields.named) {
    if (std::find(own.begin(), own.end(), name) == own.end() && !HasOwnParameter(*subcircuit.body, name) &&
        !UsesParameter(*subcircuit.body, name)) {
      return DeckError(fields.line->Place(word.offset),
                       fmt::format("{}: .subckt {} has no parameter {}", fields.words[0].text, subcircuit.name, name));
    }
    const auto value = Value(fields, word, instance);
    if (!value.ok()) return value.status();
    scope.DefineValue(name, *value);
    given.insert(name);
  }
  for (std::size_t k = 0; k < subcircuit.defaults.size(); k += 2) {
    scope.Define(Lower(subcircuit.defaults[k].text), subcircuit.defaults[k + 1].text);
  }
  return given;
}

absl::Status DeckCircuit::ResolveControls() {
  for (const PendingControl& control : pending_controls_) {
    const Index element = ElementNamed(Lower(control.name));
    if (element < 0 && control.by_any) {
      return DeckError(control.place, fmt::format("{}: there is no element {}, whose current it takes",
                                                  circuit_.elements[AsSize(control.element)].name, control.name));
    }
    if (!control.by_any && (element < 0 || circuit_.elements[AsSize(element)].kind != ElementKind::kVoltageSource)) {
      return DeckError(control.place,
                       fmt::format("{}: \"{}\" is not a voltage source; a current is measured in one (0 V will do)",
                                   circuit_.elements[AsSize(control.element)].name, control.name));
    }
    circuit_.elements[AsSize(control.element)].controls.push_back({.factor = control.factor, .element = element});
  }
  return absl::OkStatus();
}

std::optional<KnownQuantity> DeckCircuit::KnownOf(const Instance& instance, const std::string& quantity) {
  const std::string inside = quantity.substr(2, quantity.size() - 3);
  if (quantity[0] != 'v' || inside.starts_with(' ')) return std::nullopt;
  if (!sources_.known) {
    sources_.of_deck = std::make_unique<DeckCircuit>(parts_, options_, sources_.notes);
    DeckCircuit& sources = *sources_.of_deck;
    sources.only_voltage_sources_ = true;
    sources.turns_sources_on_ = turns_sources_on_;
    // What is wrong is said where the whole circuit is made. Until there nothing is known.
    if (!sources.AddAll(*global_, step_, circuit_.horizon).ok()) sources.circuit_.elements.clear();
    sources_.known.emplace(sources.circuit_);
  }
  const auto node_of = [&](const std::string& name) -> Index {
    if (name == "0" || name == "gnd") return 0;
    std::string full = (parts_.globals.contains(name) ? "" : Lower(instance.prefix)) + name;
    if (const auto port = instance.nodes.find(name); port != instance.nodes.end()) {
      if (port->second == 0) return 0;
      full = Lower(circuit_.nodes[AsSize(port->second)]);
    }
    return sources_.of_deck->NodeNamed(full);
  };
  const std::size_t comma = inside.find(',');
  const Index plus = node_of(inside.substr(0, comma));
  const Index minus = comma == std::string::npos ? 0 : node_of(inside.substr(comma + 1));
  if (plus < 0 || minus < 0) return std::nullopt;
  return sources_.known->Between(plus, minus);
}

absl::Status DeckCircuit::ResolveCouplings() {
  std::set<std::pair<Index, Index>> coupled;
  for (const PendingCoupling& coupling : pending_couplings_) {
    const auto inductor = [&](const std::string& name) {
      const Index element = ElementNamed(Lower(name));
      return element >= 0 && circuit_.elements[AsSize(element)].kind == ElementKind::kInductor ? element : Index{-1};
    };
    const Index one = inductor(coupling.one), other = inductor(coupling.other);
    if (one < 0)
      return DeckError(coupling.one_place, fmt::format("{}: \"{}\" is not an inductor", coupling.name, coupling.one));
    if (other < 0)
      return DeckError(coupling.other_place,
                       fmt::format("{}: \"{}\" is not an inductor", coupling.name, coupling.other));
    if (one == other)
      return DeckError(coupling.one_place, fmt::format("{} couples {} with itself", coupling.name, coupling.one));
    if (!coupled.insert(std::minmax(one, other)).second) {
      return DeckError(coupling.one_place,
                       fmt::format("{}: {} and {} are coupled twice", coupling.name, coupling.one, coupling.other));
    }
    if (!(std::abs(coupling.value) <= 1) || coupling.value == 0) {
      return DeckError(
          coupling.value_place,
          fmt::format("{}: a coupling of {:g}; must be above 0 and at most 1 in size", coupling.name, coupling.value));
    }
    circuit_.couplings.push_back({coupling.name, one, other, coupling.value});
  }
  return absl::OkStatus();
}

}  // namespace dlcs::client
