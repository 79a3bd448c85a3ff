// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_words.h"

#include <algorithm>

#include "client/netlist/spice_number.h"

namespace dlcs::client {
namespace {

bool SeparatesWords(char letter) { return letter == ' ' || letter == '\t' || letter == ',' || letter == '\r'; }

// Where the expression that opens at `begin` closes; the end of the text where it does not.
std::size_t CloseOf(std::string_view text, std::size_t begin) {
  if (text[begin] == '\'') return std::min(text.find('\'', begin + 1), text.size());
  int depth = 0;
  for (std::size_t at = begin; at < text.size(); ++at) {
    if (text[at] == '{') ++depth;
    if (text[at] == '}' && --depth == 0) return at;
  }
  return text.size();
}

// The length of (D1-K) at `at` in a net of KiCad, Net-(D1-K), whose name begins at `begin`; 0 if there is none. Before
// a parenthesis that opens something else there is no minus sign, or a number.
std::size_t PartInParentheses(std::string_view text, std::size_t begin, std::size_t at) {
  if (text[at] != '(' || at == begin || text[at - 1] != '-' || IsSpiceDigit(text[begin])) return 0;
  const std::size_t close = text.find_first_of(" \t\r,()={}'", at + 1);
  if (close == std::string_view::npos || text[close] != ')' || close == at + 1) return 0;
  return close + 1 - at;
}

}  // namespace

std::vector<DeckWord> WordsOf(const DeckLine& line) {
  const std::string_view text = line.text;
  std::vector<DeckWord> words;
  for (std::size_t at = 0; at < text.size();) {
    if (SeparatesWords(text[at])) {
      ++at;
    } else if (text[at] == '(' || text[at] == ')' || text[at] == '=') {
      words.push_back({std::string(1, text[at]), at, false});
      ++at;
    } else if (text[at] == '{' || text[at] == '\'') {
      const std::size_t close = CloseOf(text, at);
      words.push_back({std::string(text.substr(at + 1, close - at - 1)), at, true});
      at = close + 1;
    } else {
      const std::size_t begin = at;
      while (at < text.size() && !SeparatesWords(text[at])) {
        const std::size_t part = PartInParentheses(text, begin, at);
        if (part == 0 && std::string_view("()={'").find(text[at]) != std::string_view::npos) break;
        at += std::max<std::size_t>(part, 1);
      }
      words.push_back({std::string(text.substr(begin, at - begin)), begin, false});
    }
  }
  return words;
}

std::optional<std::size_t> UnclosedIn(std::string_view text) {
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] != '{' && text[at] != '\'') continue;
    const std::size_t close = CloseOf(text, at);
    if (close == text.size()) return at;
    at = close;
  }
  return std::nullopt;
}

absl::StatusOr<std::vector<Definition>> DefinitionsOf(const DeckLine& line, std::size_t offset) {
  const std::string& text = line.text;
  std::vector<Definition> definitions;
  std::size_t at = std::min(offset, text.size());
  const auto skip = [&] {
    while (at < text.size() && SeparatesWords(text[at])) ++at;
  };
  for (skip(); at < text.size(); skip()) {
    Definition made;
    made.offset = at;
    while (at < text.size() && !SeparatesWords(text[at]) && text[at] != '=') made.name += text[at++];
    skip();
    if (at >= text.size() || text[at] != '=' || made.name.empty()) {
      return DeckError(line.Place(made.offset), "expected name=value");
    }
    ++at;
    while (at < text.size() && (text[at] == ' ' || text[at] == '\t')) ++at;
    if (at < text.size() && (text[at] == '{' || text[at] == '\'')) {
      const std::size_t close = CloseOf(text, at);
      made.expression = text.substr(at + 1, close - at - 1);
      at = close + 1;
    } else {
      // Ends at a blank that the next definition follows.
      int depth = 0;
      const std::size_t begin = at;
      for (; at < text.size(); ++at) {
        if (text[at] == '(') ++depth;
        if (text[at] == ')') --depth;
        if (depth > 0 || !SeparatesWords(text[at])) continue;
        std::size_t next = text.find_first_not_of(" \t,\r", at);
        if (next == std::string::npos) break;
        const std::size_t name_end = text.find_first_of(" \t,=\r+-*/()<>?:", next);
        const std::size_t equals = name_end == std::string::npos ? name_end : text.find_first_not_of(" \t\r", name_end);
        const bool is_definition = name_end != next && equals != std::string::npos && text[equals] == '=' &&
                                   (equals + 1 >= text.size() || text[equals + 1] != '=');
        if (is_definition) break;
      }
      made.expression = Trimmed(std::string_view(text).substr(begin, at - begin));
    }
    if (made.expression.empty()) return DeckError(line.Place(made.offset), "a value is missing after =");
    definitions.push_back(made);
  }
  return definitions;
}

std::string Trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) text.remove_suffix(1);
  return std::string(text);
}

std::string WithoutBraces(std::string_view text) {
  if (text.size() >= 2 &&
      ((text.front() == '{' && text.back() == '}') || (text.front() == '\'' && text.back() == '\''))) {
    return std::string(text.substr(1, text.size() - 2));
  }
  return std::string(text);
}

}  // namespace dlcs::client
