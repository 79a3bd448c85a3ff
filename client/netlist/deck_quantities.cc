// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_quantities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <string_view>
#include <utility>

#include "client/netlist/deck_values.h"
#include "client/netlist/deck_words.h"

namespace dlcs::client {
namespace {

bool IsSpaceOrTab(char letter) { return letter == ' ' || letter == '\t' || letter == '\r'; }

// The end of the item of `text` that begins at `begin`: the next separator outside of brackets and quotes.
std::size_t EndOfItem(std::string_view text, std::size_t begin) {
  int depth = 0;
  for (std::size_t at = begin; at < text.size(); ++at) {
    const char letter = text[at];
    if (letter == '\'') {
      at = text.find('\'', at + 1);
      if (at == std::string_view::npos) return text.size();
      continue;
    }
    if (letter == '(' || letter == '{') ++depth;
    if (letter == ')' || letter == '}') --depth;
    if (depth > 0) continue;
    if (letter == '=' || letter == ',') return at;
    if (!IsSpaceOrTab(letter)) continue;
    // "v (out)" is one item.
    const std::size_t next = text.find_first_not_of(" \t\r", at);
    const std::string before = Lower(text.substr(begin, at - begin));
    if (next == std::string_view::npos || text[next] != '(' || (before != "v" && before != "i")) return at;
  }
  return text.size();
}

// Whether the parenthesis that `text` begins with is closed by its last letter.
bool ClosesAtEnd(std::string_view text) {
  int depth = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '(') ++depth;
    if (text[at] == ')' && --depth == 0) return at + 1 == text.size();
  }
  return false;
}

// Without braces, quotes, parentheses or par(...) around it.
std::string BareExpression(const std::string& text) {
  std::string bare = WithoutBraces(text);
  if (Lower(bare.substr(0, 4)) == "par(" && bare.back() == ')') {
    bare = WithoutBraces(Trimmed(std::string_view(bare).substr(4, bare.size() - 5)));
  }
  while (bare.size() > 2 && bare[0] == '(' && ClosesAtEnd(bare)) bare = Trimmed(bare.substr(1, bare.size() - 2));
  return bare;
}

// @r1[i] and v1#branch, as ngspice calls currents, as i(r1) and i(v1); any other text as it is.
std::string WithCurrents(const std::string& text) {
  if (text.size() > 4 && text[0] == '@' && Lower(text).ends_with("[i]")) {
    return "i(" + text.substr(1, text.size() - 4) + ")";
  }
  constexpr std::string_view kBranch = "#branch";
  if (text.size() > kBranch.size() && Lower(text).ends_with(kBranch)) {
    return "i(" + text.substr(0, text.size() - kBranch.size()) + ")";
  }
  return text;
}

// id(m1), as LTspice calls the current into the drain, as i(m1).
std::string WithDrainCurrents(std::string text) {
  for (std::size_t at = 0; at + 2 < text.size(); ++at) {
    const bool begins = at == 0 || (std::isalnum(static_cast<unsigned char>(text[at - 1])) == 0 && text[at - 1] != '_');
    if (begins && Lower(std::string_view(text).substr(at, 3)) == "id(") text.erase(at + 1, 1);
  }
  return text;
}

// The factors of `text`, cut at each * outside of parentheses; `text` alone where it is a sum.
std::vector<std::string> FactorsOf(const std::string& text) {
  std::vector<std::string> factors(1);
  int depth = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '(') ++depth;
    if (text[at] == ')') --depth;
    const bool is_sign = Trimmed(factors.back()).empty();
    if (depth == 0 && (text[at] == '+' || text[at] == '-') && !is_sign) return {text};
    if (depth == 0 && std::string_view("?:<>=&|!").find(text[at]) != std::string_view::npos) return {text};
    const bool is_power = text.compare(at, 2, "**") == 0;
    if (is_power) return {text};
    if (depth == 0 && text[at] == '*') {
      factors.emplace_back();
    } else {
      factors.back() += text[at];
    }
  }
  return factors;
}

// p(r1) and @r1[p], as ngspice calls powers.
bool IsPower(const std::string& lower) {
  return lower.starts_with("p(") || (lower.starts_with("@") && lower.ends_with("[p]"));
}

// The name of a voltage or current that does not exist; empty if all do.
std::string UnknownName(const LinearValue& value, const DeckCircuit& circuit) {
  for (const auto& [quantity, factor] : value.factors) {
    const std::string inside = quantity.substr(2, quantity.size() - 3);
    if (quantity[0] == 'i') {
      if (circuit.ElementNamed(inside) < 0) return fmt::format("{}: the deck has no element \"{}\"", quantity, inside);
      continue;
    }
    const std::size_t comma = inside.find(',');
    for (const std::string& node :
         {inside.substr(0, comma), comma == std::string::npos ? std::string("0") : inside.substr(comma + 1)}) {
      if (node != "0" && node != "gnd" && circuit.NodeNamed(node) < 0) {
        return fmt::format("{}: the deck has no node \"{}\"{}", quantity, node, circuit.HintOnNode(node));
      }
    }
  }
  return "";
}

}  // namespace

std::vector<DeckItem> ItemsOf(const DeckLine& line) {
  const std::string_view text = line.text;
  std::vector<DeckItem> items;
  for (std::size_t at = 0; at < text.size();) {
    if (IsSpaceOrTab(text[at]) || text[at] == ',') {
      ++at;
      continue;
    }
    const std::size_t end = text[at] == '=' ? at + 1 : std::max(EndOfItem(text, at), at + 1);
    items.push_back({std::string(text.substr(at, end - at)), at});
    at = end;
  }
  return items;
}

absl::StatusOr<DeckQuantity> QuantityOf(const DeckLine& line, const DeckItem& item, ParameterScope& scope,
                                        const DeckCircuit& circuit) {
  const std::string expression = WithDrainCurrents(WithCurrents(BareExpression(item.text)));
  DeckQuantity quantity{.text = item.text, .factors = {}};
  const auto fail = [&](const std::string& why) {
    return DeckError(line.Place(item.offset), fmt::format("{}: {}", item.text, why));
  };
  auto linear = scope.EvaluateLinear(expression);
  if (linear.ok()) {
    quantity.factors.push_back(*std::move(linear));
  } else {
    const std::vector<std::string> factors = FactorsOf(expression);
    for (const std::string& factor : factors) {
      auto value = scope.EvaluateLinear(factor);
      if (factors.size() == 1 || !value.ok()) return fail(std::string(linear.status().message()));
      quantity.factors.push_back(*std::move(value));
    }
  }
  for (const LinearValue& factor : quantity.factors) {
    if (const std::string unknown = UnknownName(factor, circuit); !unknown.empty()) {
      return DeckError(line.Place(item.offset), unknown);
    }
  }
  const bool is_constant = std::all_of(quantity.factors.begin(), quantity.factors.end(),
                                       [](const LinearValue& factor) { return factor.factors.empty(); });
  if (is_constant) return fail("neither a voltage nor a current");
  return quantity;
}

absl::StatusOr<std::vector<DeckQuantity>> PrintedQuantities(const std::vector<const DeckLine*>& lines,
                                                            ParameterScope& scope, const DeckCircuit& circuit,
                                                            DeckNotes& notes) {
  static const std::set<std::string> kOtherAnalyses = {"ac", "dc", "op", "noise", "disto", "tf"};
  static const std::set<std::string> kEverything = {"all", "alli", "allv", "i(*)", "v(*)"};
  std::vector<DeckQuantity> printed;
  bool everything = false;
  for (const DeckLine* line : lines) {
    const std::vector<DeckItem> items = ItemsOf(*line);
    const std::string command = items.empty() ? "" : Lower(items[0].text);
    const bool is_generated = command == ".probe" || command == ".save";  // KiCad asks for all that there is
    for (std::size_t k = 1; k < items.size(); ++k) {
      const std::string lower = Lower(items[k].text);
      if (k == 1 && lower == "tran") continue;
      if (k == 1 && kOtherAnalyses.contains(lower)) {
        notes.Add(
            fmt::format("{}: {} {} is ignored: only .tran is solved", line->Place(), items[0].text, items[k].text));
        break;
      }
      // OrCAD asks for V(alias(*)) and I(alias(*)), and for powers, charges and noise.
      const bool of_all_aliases = is_generated && lower.ends_with("(alias(*))");
      if (kEverything.contains(lower) || of_all_aliases) {
        everything = true;
        continue;
      }
      auto quantity = QuantityOf(*line, items[k], scope, circuit);
      if (!quantity.ok() && IsPower(lower)) {
        const std::string why =
            fmt::format("{}: a power is not a curve; .meas takes products, as V(a,b)*I(R1)", items[k].text);
        if (!is_generated) return DeckError(line->Place(items[k].offset), why);
        notes.Add(fmt::format("{}: {}", line->Place(), why));
        continue;
      }
      if (!quantity.ok()) return quantity.status();
      if (quantity->factors.size() > 1) {
        return DeckError(line->Place(items[k].offset),
                         fmt::format("{}: a product can be measured (.meas), but is not a curve", items[k].text));
      }
      printed.push_back(*std::move(quantity));
    }
  }
  if (everything) printed.clear();
  return printed;
}

}  // namespace dlcs::client
