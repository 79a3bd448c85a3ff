// SPDX-License-Identifier: Apache-2.0
// Controlled sources: E F G H, and B with its expressions.
#include <fmt/format.h>

#include <utility>

#include "client/netlist/deck_circuit.h"

namespace dlcs::client {

absl::Status DeckCircuit::AddControlled(const DeckFields& fields, const Instance& instance, Element element,
                                        char kind) {
  const bool by_voltage = kind == 'e' || kind == 'g';
  element.kind = kind == 'e'   ? ElementKind::kVcvs
                 : kind == 'g' ? ElementKind::kVccs
                 : kind == 'h' ? ElementKind::kCcvs
                               : ElementKind::kCccs;
  const char* form = by_voltage ? "ENAME NODE NODE CONTROL+ CONTROL- GAIN" : "FNAME NODE NODE VNAME GAIN";
  if (absl::Status status = NeedWords(fields, 3, form); !status.ok()) return status;
  const std::string next = fields.words.size() > 3 ? Lower(fields.words[3].text) : "";
  if (fields.named.contains("value") || fields.named.contains("cur") || fields.named.contains("vol")) {
    return AddBehavioral(fields, instance, element);
  }
  if (next == "poly" || next == "table" || next == "laplace" || next == "value" || next == "cur" || next == "vol") {
    return DeckError(fields.Place(3),
                     fmt::format("{}: {} is not supported; linear gains, and expressions VALUE={{...}} "
                                 "that are linear, are",
                                 fields.words[0].text, fields.words[3].text));
  }
  if (absl::Status status = NeedWords(fields, by_voltage ? 6 : 5, form); !status.ok()) return status;
  element.plus = NodeOf(instance, fields.words[1].text);
  element.minus = NodeOf(instance, fields.words[2].text);
  const std::size_t gain = by_voltage ? 5 : 4;
  const auto value = Value(fields, fields.words[gain], instance);
  if (!value.ok()) return value.status();
  element.value = *value;
  if (by_voltage) {
    element.control_plus = NodeOf(instance, fields.words[3].text);
    element.control_minus = NodeOf(instance, fields.words[4].text);
  } else {
    PendControl(instance, fields, 3);
  }
  if (absl::Status status = RefuseRest(fields, gain + 1, {}); !status.ok()) return status;
  return Store(std::move(element), fields);
}

// A linear expression of voltages and currents: a chain of controlled sources (in series for a voltage, in parallel
// for a current).
absl::Status DeckCircuit::AddBehavioral(const DeckFields& fields, const Instance& instance, const Element& element) {
  if (absl::Status status = NeedWords(fields, 3, "BNAME NODE NODE V={...} or I={...}"); !status.ok()) return status;
  const char kind = Lower(fields.words[0].text)[0];
  const DeckWord* expression = nullptr;
  bool is_voltage = kind == 'e';
  for (const auto& [name, word] : fields.named) {
    const bool fits = (kind == 'b' && (name == "v" || name == "i")) ||
                      (kind == 'e' && (name == "value" || name == "vol")) ||
                      (kind == 'g' && (name == "value" || name == "cur"));
    if (!fits || expression != nullptr) {
      return DeckError(fields.line->Place(word.offset),
                       fmt::format("{}: {}={} is not supported", fields.words[0].text, name, word.text));
    }
    expression = &word;
    if (kind == 'b') is_voltage = name == "v";
  }
  if (expression == nullptr || fields.words.size() > 3) {
    return DeckError(fields.line->Place(), fmt::format("{} is written {} with an expression in braces",
                                                       fields.words[0].text, "BNAME NODE NODE V={...} or I={...}"));
  }
  const auto value = instance.scope->EvaluateLinear(expression->text);
  if (!value.ok()) {
    return DeckError(fields.line->Place(expression->offset),
                     fmt::format("{}: {}", fields.words[0].text, std::string(value.status().message())));
  }
  return AddLinear(fields, instance, element, is_voltage, *value, expression->offset);
}

absl::Status DeckCircuit::AddLinear(const DeckFields& fields, const Instance& instance, const Element& whole,
                                    bool is_voltage, const LinearValue& value, std::size_t offset) {
  const Index plus = NodeOf(instance, fields.words[1].text), minus = NodeOf(instance, fields.words[2].text);
  Index from = plus;
  std::size_t left = value.factors.size() + 1, number = 0;
  const auto next = [&](Element& part) {
    part.name = whole.name + (number == 0 ? "" : fmt::format("#{}", number));
    part.place = whole.place;
    part.plus = from;
    part.minus = minus;
    if (is_voltage && --left > 0) {
      part.minus = static_cast<Index>(circuit_.nodes.size());
      circuit_.nodes.push_back(fmt::format("{}#{}", whole.name, number));
    }
    if (is_voltage) from = part.minus;
    ++number;
  };
  for (const auto& [quantity, factor] : value.factors) {
    Element part;
    next(part);
    part.value = factor;
    const std::string inside = quantity.substr(2, quantity.size() - 3);
    if (quantity[0] == 'v') {
      part.kind = is_voltage ? ElementKind::kVcvs : ElementKind::kVccs;
      const std::size_t comma = inside.find(',');
      part.control_plus = NodeOf(instance, inside.substr(0, comma));
      part.control_minus = comma == std::string::npos ? 0 : NodeOf(instance, inside.substr(comma + 1));
    } else {
      part.kind = is_voltage ? ElementKind::kCcvs : ElementKind::kCccs;
      pending_controls_.push_back(
          {static_cast<Index>(circuit_.elements.size()), instance.prefix + inside, fields.line->Place(offset)});
    }
    if (absl::Status status = Store(std::move(part), fields); !status.ok()) return status;
  }
  Element part;
  next(part);
  part.kind = is_voltage ? ElementKind::kVoltageSource : ElementKind::kCurrentSource;
  part.source = ConstantWave{value.constant};
  return Store(std::move(part), fields);
}

}  // namespace dlcs::client
