// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "client/netlist/spice_number.h"

namespace dlcs::client {
namespace {

// The expression of a B element needs no braces: it ends with the line. Braces may be a part of it.
void JoinExpression(const DeckLine& line, std::vector<DeckWord>& words) {
  if (words.size() < 6 || words[4].text != "=" || (words.size() == 6 && words[5].is_expression)) return;
  words[5] = {Trimmed(std::string_view(line.text).substr(words[5].offset)), words[5].offset, true};
  words.resize(6);
}

// R1 (a b) 1k is R1 a b 1k.
void OpenParenthesesOfNodes(std::vector<DeckWord>& words) {
  const auto is = [](const char* sign) {
    return [sign](const DeckWord& word) { return word.text == sign && !word.is_expression; };
  };
  if (words.size() < 2 || !is("(")(words[1])) return;
  const auto close = std::find_if(words.begin(), words.end(), is(")"));
  if (close == words.end()) return;
  words.erase(close);
  words.erase(words.begin() + 1);
}

}  // namespace

std::string DeckFields::Place(std::size_t k) const { return line->Place(words[std::min(k, words.size() - 1)].offset); }

absl::StatusOr<DeckFields> FieldsOf(const DeckLine& line) {
  DeckFields fields{&line, {}, {}};
  std::vector<DeckWord> words = WordsOf(line);
  OpenParenthesesOfNodes(words);
  if (Lower(line.text)[0] == 'b') JoinExpression(line, words);
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (k + 1 < words.size() && words[k + 1].text == "=" && !words[k + 1].is_expression) {
      if (k + 2 >= words.size()) return DeckError(line.Place(words[k].offset), "a value is missing after =");
      if (!fields.named.emplace(Lower(words[k].text), words[k + 2]).second) {
        return DeckError(line.Place(words[k].offset), fmt::format("{} is given twice", words[k].text));
      }
      k += 2;
    } else {
      fields.words.push_back(words[k]);
    }
  }
  if (fields.words.empty()) return DeckError(line.Place(), "an element needs a name");
  return fields;
}

absl::Status NeedWords(const DeckFields& fields, std::size_t count, const std::string& form) {
  if (fields.words.size() >= count) return absl::OkStatus();
  return DeckError(fields.line->Place(),
                   fmt::format("{} has too few fields; it is written {}", fields.words[0].text, form));
}

std::string HintOnBlank(const DeckFields& fields, std::size_t k) {
  constexpr std::size_t kFirstValue = 3;  // after two nodes, which may be numbers
  if (k <= kFirstValue || k >= fields.words.size()) return "";
  const DeckWord &word = fields.words[k], &before = fields.words[k - 1];
  const std::size_t end = before.offset + before.text.size();
  const std::string between = fields.line->text.substr(end, word.offset - std::min(word.offset, end));
  if (before.is_expression || word.is_expression || !ReadSpiceNumber(before.text)) return "";
  if (between == "," && ReadSpiceNumber(before.text + "." + word.text)) {
    return fmt::format("; a number has a point, as in {}.{}", before.text, word.text);
  }
  if (!ReadSpiceNumber(word.text) && ReadSpiceNumber(before.text + word.text)) {
    return fmt::format("; no blank stands before a suffix or unit, as in {}{}", before.text, word.text);
  }
  return "";
}

absl::Status RefuseRest(const DeckFields& fields, std::size_t used, const std::set<std::string>& names) {
  if (fields.words.size() > used) {
    return DeckError(fields.Place(used), fmt::format("{}: \"{}\" is not supported here{}", fields.words[0].text,
                                                     fields.words[used].text, HintOnBlank(fields, used)));
  }
  for (const auto& [name, word] : fields.named) {
    if (names.contains(name)) continue;
    return DeckError(fields.line->Place(word.offset),
                     fmt::format("{}: {}={} is not supported", fields.words[0].text, name, word.text));
  }
  return absl::OkStatus();
}

}  // namespace dlcs::client
