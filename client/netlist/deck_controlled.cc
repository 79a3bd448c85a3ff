// SPDX-License-Identifier: Apache-2.0
// Controlled sources: E F G H, and B with its expressions.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "client/netlist/deck_circuit.h"
#include "core/problem/formula.h"

namespace dlcs::client {
namespace {

// Words without parentheses, from `begin` on.
std::vector<DeckWord> WithoutParentheses(const std::vector<DeckWord>& words, std::size_t begin) {
  std::vector<DeckWord> kept;
  for (std::size_t k = begin; k < words.size(); ++k) {
    if (words[k].text != "(" && words[k].text != ")") kept.push_back(words[k]);
  }
  return kept;
}

// The products of a polynomial of `controls` variables in the order of SPICE: 1, a, b, a a, a b, b b, a a a, ...
void MoveToNext(std::vector<std::size_t>& product, std::size_t controls) {
  std::size_t at = product.size();
  while (at > 0 && product[at - 1] + 1 == controls) --at;
  if (at == 0) {
    product.assign(product.size() + 1, 0);
  } else {
    std::fill(product.begin() + static_cast<std::ptrdiff_t>(at) - 1, product.end(), product[at - 1] + 1);
  }
}

// A formula with its largest size at some times.
Waveform FormulaOver(const std::string& text, double horizon) {
  constexpr int kTimes = 1000;
  auto formula = Formula::Parse(text);
  double peak = formula.ok() ? 0 : std::nan("");
  for (int k = 0; k < kTimes && formula.ok(); ++k) {
    const double value = std::abs(formula->Evaluate(horizon * (k + 0.5) / kTimes));
    peak = value <= peak ? peak : value;
  }
  return FormulaWave{text, peak};
}

}  // namespace

absl::Status DeckCircuit::AddControlled(const DeckFields& fields, const Instance& instance, Element element,
                                        char kind) {
  const bool by_voltage = kind == 'e' || kind == 'g';
  element.kind = kind == 'e' || kind == 'h' ? ElementKind::kControlledVoltage : ElementKind::kControlledCurrent;
  const char* form = by_voltage ? "ENAME NODE NODE CONTROL+ CONTROL- GAIN" : "FNAME NODE NODE VNAME GAIN";
  if (absl::Status status = NeedWords(fields, 3, form); !status.ok()) return status;
  // HSPICE repeats the kind, as in E1 b 0 VCVS a 0 2; a node may have that name too.
  static const std::map<char, std::string> kKinds = {{'e', "vcvs"}, {'f', "cccs"}, {'g', "vccs"}, {'h', "ccvs"}};
  if (fields.words.size() > 3 && Lower(fields.words[3].text) == kKinds.at(kind)) {
    const bool is_node = by_voltage && fields.named.empty() && fields.words.size() == 6;
    if (!is_node) {
      DeckFields rest = fields;
      rest.words.erase(rest.words.begin() + 3);
      return AddControlled(rest, instance, std::move(element), kind);
    }
  }
  const std::string next = fields.words.size() > 3 ? Lower(fields.words[3].text) : "";
  const bool has_expression = fields.named.contains("value") || fields.named.contains("cur") ||
                              fields.named.contains("vol") || next == "value" || next == "cur" || next == "vol";
  if (by_voltage && has_expression) return AddBehavioral(fields, instance, std::move(element));
  element.plus = NodeOf(instance, fields.words[1].text);
  element.minus = NodeOf(instance, fields.words[2].text);
  if (next == "poly") return AddPolynomial(fields, instance, std::move(element), by_voltage);
  const bool has_table = next == "table" || fields.named.contains("table") ||
                         (fields.words.size() > 5 && Lower(fields.words[5].text) == "table");
  if (by_voltage && has_table) return AddTable(fields, instance, std::move(element));
  for (const char* function : {"laplace", "freq"}) {
    if (next != function && !fields.named.contains(function)) continue;
    return DeckError(fields.line->Place(), fmt::format("{}: {} is not supported; build the transfer function of R, C "
                                                       "and controlled sources",
                                                       fields.words[0].text, function));
  }
  // The controlling nodes may be in parentheses.
  DeckFields plain = fields;
  plain.words = WithoutParentheses(fields.words, 0);
  if (absl::Status status = NeedWords(plain, by_voltage ? 6 : 5, form); !status.ok()) return status;
  const std::size_t gain = by_voltage ? 5 : 4;
  const auto value = Value(plain, plain.words[gain], instance);
  if (!value.ok()) return value.status();
  if (by_voltage) {
    element.controls = {{.factor = *value,
                         .plus = NodeOf(instance, plain.words[3].text),
                         .minus = NodeOf(instance, plain.words[4].text)}};
  } else {
    PendControl(instance, plain, 3, *value);
  }
  if (absl::Status status = RefuseRest(plain, gain + 1, {}); !status.ok()) return status;
  return Store(std::move(element), fields);
}

// POLY(n), n controls, and the coefficients of 1, of the controls and of their products. Those are 0 where more than
// one factor is no constant.
absl::Status DeckCircuit::AddPolynomial(const DeckFields& fields, const Instance& instance, Element element,
                                        bool by_voltage) {
  DeckFields plain = fields;
  plain.words = WithoutParentheses(fields.words, 4);
  const std::size_t width = by_voltage ? 2 : 1;
  double count = 0;
  if (!plain.words.empty()) {
    const auto given = Value(plain, plain.words[0], instance);
    if (!given.ok()) return given.status();
    count = *given;
  }
  if (!(count >= 1) || count > 64 || count != static_cast<double>(static_cast<std::size_t>(count)) ||
      plain.words.size() < 2 + width * static_cast<std::size_t>(count)) {
    return DeckError(fields.Place(3),
                     fmt::format("{}: expected POLY(n), n controls and coefficients, as in POLY(1) {} 0 2",
                                 fields.words[0].text, by_voltage ? "a b" : "V1"));
  }
  const auto controls = static_cast<std::size_t>(count), first = 1 + width * controls;
  std::vector<std::optional<double>> constants(controls);
  for (std::size_t k = 0; by_voltage && k < controls; ++k) {
    const auto known = KnownOf(
        instance, fmt::format("v({},{})", Lower(plain.words[1 + 2 * k].text), Lower(plain.words[2 + 2 * k].text)));
    if (known) constants[k] = known->constant;
  }
  constexpr std::size_t kMaxDegree = 8;
  std::vector<double> coefficients(controls + 1);
  std::vector<std::size_t> product;
  for (std::size_t k = first; k < plain.words.size(); ++k) {
    const auto value = Value(plain, plain.words[k], instance);
    if (!value.ok()) return value.status();
    // Of a product of at least two factors the one that changes.
    std::size_t changing = product.size() == 1 ? product[0] + 1 : 0;
    double factor = *value;
    bool is_linear = product.size() <= kMaxDegree;
    for (std::size_t at = 0; product.size() > 1 && at < product.size(); ++at) {
      if (constants[product[at]]) {
        factor *= *constants[product[at]];
      } else {
        is_linear = is_linear && changing == 0;
        changing = product[at] + 1;
      }
    }
    if (*value != 0 && !is_linear) {
      return DeckError(plain.Place(k),
                       fmt::format("{}: a polynomial with powers or products is not linear, and not supported, unless "
                                   "all but one factor of a product are voltages of DC sources",
                                   fields.words[0].text));
    }
    if (*value != 0) coefficients[changing] += factor;
    if (product.size() <= kMaxDegree) MoveToNext(product, controls);
  }
  // One coefficient alone of one control is its gain.
  if (controls == 1 && plain.words.size() == first + 1) std::swap(coefficients[0], coefficients[1]);
  element.value = coefficients[0];
  for (std::size_t k = 0; k < controls; ++k) {
    if (by_voltage) {
      element.controls.push_back({.factor = coefficients[k + 1],
                                  .plus = NodeOf(instance, plain.words[1 + 2 * k].text),
                                  .minus = NodeOf(instance, plain.words[2 + 2 * k].text)});
    } else {
      PendControl(instance, plain, 1 + k, coefficients[k + 1]);
    }
  }
  for (const auto& [name, word] : fields.named) {
    return DeckError(fields.line->Place(word.offset),
                     fmt::format("{}: {}={} is not supported", fields.words[0].text, name, word.text));
  }
  return Store(std::move(element), fields);
}

// TABLE {expression} = (x, y) (x, y) ..., or CONTROL+ CONTROL- TABLE = (x, y, x, y, ...): lines between the points, and
// constant beyond them.
absl::Status DeckCircuit::AddTable(const DeckFields& fields, const Instance& instance, Element element) {
  const std::string& name = fields.words[0].text;
  const std::string_view text = fields.line->text;
  const std::string lower = Lower(text);
  // Splits the line again after the word, since "=" would pair words.
  const std::vector<DeckWord> words = WithoutParentheses(WordsOf(*fields.line), 0);
  const auto table =
      std::find_if(words.begin(), words.end(), [](const DeckWord& word) { return Lower(word.text) == "table"; });
  auto at = table + 1;
  const auto is_equals = [](const DeckWord& word) { return word.text == "=" && !word.is_expression; };
  LinearValue argument;
  const std::size_t place = table->offset;
  if (table - words.begin() == 5) {
    element.controls = {{.plus = NodeOf(instance, words[3].text), .minus = NodeOf(instance, words[4].text)}};
  } else if (table - words.begin() == 3) {
    if (at != words.end() && is_equals(*at)) ++at;
    if (at == words.end() || !at->is_expression) {
      return DeckError(fields.line->Place(place), fmt::format("{}: TABLE needs an expression in braces", name));
    }
    auto value = LinearOf(fields, instance, *at, element);
    if (!value.ok()) return value.status();
    if (!value->of_time.empty()) {
      const auto quantity = AddFormula(fields, element.name + "#time", element.place, value->of_time);
      if (!quantity.ok()) return quantity.status();
      value->factors[*quantity] = 1;
    }
    SetControls(fields, instance, *value, at->offset, element);
    ++at;
  } else {
    return DeckError(fields.line->Place(place), fmt::format("{}: TABLE is not expected here", name));
  }
  if (at != words.end() && is_equals(*at)) ++at;
  PiecewiseLinear transfer;
  for (bool is_x = true; at != words.end(); ++at, is_x = !is_x) {
    const auto value = Value(fields, *at, instance);
    if (!value.ok()) return value.status();
    (is_x ? transfer.x : transfer.y).push_back(*value);
  }
  if (transfer.x.size() < 2 || transfer.x.size() != transfer.y.size()) {
    return DeckError(fields.line->Place(place), fmt::format("{}: TABLE takes at least two pairs of numbers", name));
  }
  if (!std::is_sorted(transfer.x.begin(), transfer.x.end())) {
    return DeckError(fields.line->Place(place),
                     fmt::format("{}: the points of TABLE must be in increasing order", name));
  }
  element.transfer = std::move(transfer);
  return Store(std::move(element), fields);
}

// A piecewise linear expression of voltages and currents.
absl::Status DeckCircuit::AddBehavioral(const DeckFields& fields, const Instance& instance, Element element) {
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
  // VALUE {...}
  const bool without_equals =
      kind != 'b' && expression == nullptr && fields.words.size() == 5 && fields.words[4].is_expression;
  if (without_equals) expression = &fields.words[4];
  if (expression == nullptr || fields.words.size() > (without_equals ? 5 : 3)) {
    const char* form = kind == 'b'   ? "BNAME NODE NODE V={...} or I={...}"
                       : kind == 'e' ? "ENAME NODE NODE VALUE={...}"
                                     : "GNAME NODE NODE VALUE={...}";
    return DeckError(fields.line->Place(),
                     fmt::format("{} is written {} with an expression in braces", fields.words[0].text, form));
  }
  element.kind = is_voltage ? ElementKind::kControlledVoltage : ElementKind::kControlledCurrent;
  element.plus = NodeOf(instance, fields.words[1].text);
  element.minus = NodeOf(instance, fields.words[2].text);
  const auto value = LinearOf(fields, instance, *expression, element);
  if (!value.ok()) return value.status();
  if (value->factors.empty()) {
    element.kind = is_voltage ? ElementKind::kVoltageSource : ElementKind::kCurrentSource;
    element.source = ConstantWave{value->constant};
    if (!value->of_time.empty()) {
      element.source = FormulaOver(fmt::format("{} + {}", value->constant, value->of_time), circuit_.horizon);
      if (const std::string fault = FaultOf(element.source); !fault.empty()) {
        return DeckError(fields.line->Place(expression->offset), fmt::format("{}: {}", element.name, fault));
      }
    }
  } else {
    SetControls(fields, instance, *value, expression->offset, element);
  }
  return Store(std::move(element), fields);
}

// The linear part of an expression. Its piecewise linear functions become elements "B1#1", "B1#2", ..., between a node
// of the same name and ground.
absl::StatusOr<LinearValue> DeckCircuit::LinearOf(const DeckFields& fields, const Instance& instance,
                                                  const DeckWord& word, const Element& whole) {
  absl::Status stored = absl::OkStatus();
  int number = 0;
  const auto add_formula = [&](LinearValue value) {
    if (value.of_time.empty() || !stored.ok()) return value;
    const auto quantity = AddFormula(fields, fmt::format("{}#{}", whole.name, ++number), whole.place, value.of_time);
    stored.Update(quantity.status());
    if (quantity.ok()) value.factors[*quantity] = 1;
    value.of_time.clear();
    return value;
  };
  const auto make = [&](const LinearValue& given, const PiecewiseLinear& function) {
    const LinearValue argument = add_formula(given);
    Element part;
    part.name = fmt::format("{}#{}", whole.name, ++number);
    part.place = whole.place;
    part.kind = ElementKind::kControlledVoltage;
    part.plus = static_cast<Index>(circuit_.nodes.size());
    circuit_.nodes.push_back(part.name);
    part.transfer = function;
    std::string quantity = fmt::format("v( {})", part.plus) /* no name has a blank */;
    SetControls(fields, instance, argument, word.offset, part);
    if (absl::Status status = CheckCount(fields); !status.ok()) {
      stored.Update(status);
      return quantity;
    }
    stored.Update(Store(std::move(part), fields));
    return quantity;
  };
  const auto know = [&](const std::string& quantity) { return KnownOf(instance, quantity); };
  auto value = instance.scope->EvaluateLinear(word.text, make, know);
  if (value.ok() && !value->factors.empty()) value = add_formula(*std::move(value));
  if (!stored.ok()) return stored;
  if (value.ok()) return value;
  return DeckError(fields.line->Place(word.offset),
                   fmt::format("{}: {}", fields.words[0].text, std::string(value.status().message())));
}

absl::StatusOr<std::string> DeckCircuit::AddFormula(const DeckFields& fields, const std::string& name,
                                                    const std::string& place, const std::string& text) {
  Element source;
  source.name = name;
  source.place = place;
  source.kind = ElementKind::kVoltageSource;
  source.plus = static_cast<Index>(circuit_.nodes.size());
  source.source = FormulaOver(text, circuit_.horizon);
  if (const std::string fault = FaultOf(source.source); !fault.empty()) {
    return DeckError(fields.line->Place(), fmt::format("{}: {}", name, fault));
  }
  circuit_.nodes.push_back(name);
  const std::string quantity = fmt::format("v( {})", source.plus) /* no name has a blank */;
  if (absl::Status status = CheckCount(fields); !status.ok()) return status;
  if (absl::Status status = Store(std::move(source), fields); !status.ok()) return status;
  return quantity;
}

void DeckCircuit::SetControls(const DeckFields& fields, const Instance& instance, const LinearValue& value,
                              std::size_t offset, Element& element) {
  element.value = value.constant;
  for (const auto& [quantity, factor] : value.factors) {
    const std::string inside = quantity.substr(2, quantity.size() - 3);
    if (quantity[0] == 'i') {
      pending_controls_.push_back({static_cast<Index>(circuit_.elements.size()), factor, instance.prefix + inside,
                                   fields.line->Place(offset), /*by_any=*/true});
    } else if (inside.starts_with(' ')) {
      element.controls.push_back({.factor = factor, .plus = static_cast<Index>(std::stol(inside.substr(1)))});
    } else {
      const std::size_t comma = inside.find(',');
      element.controls.push_back(
          {.factor = factor,
           .plus = NodeOf(instance, inside.substr(0, comma)),
           .minus = comma == std::string::npos ? 0 : NodeOf(instance, inside.substr(comma + 1))});
    }
  }
}

}  // namespace dlcs::client
