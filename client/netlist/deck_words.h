// SPDX-License-Identifier: Apache-2.0
// The words of a line of a deck.

#ifndef DLCS_CLIENT_NETLIST_DECK_WORDS_H_
#define DLCS_CLIENT_NETLIST_DECK_WORDS_H_

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_lines.h"

namespace dlcs::client {

struct DeckWord {
  std::string text;
  std::size_t offset = 0;      // in the line
  bool is_expression = false;  // it was in braces or single quotes, which `text` has no more
};

// name=value pairs, names in small letters.
using NamedWords = std::map<std::string, DeckWord>;

// Words are separated by blanks and commas. "(", ")" and "=" are words of their own; an expression in braces or single
// quotes is one word, and so is the name of a net of KiCad with parentheses, Net-(D1-K).
std::vector<DeckWord> WordsOf(const DeckLine& line);

// Where a brace or a single quote opens that nothing closes.
std::optional<std::size_t> UnclosedIn(std::string_view text);

// name = expression
struct Definition {
  std::string name, expression;
  std::size_t offset = 0;
};
// The definitions of a .param line from `offset` on; expressions are in braces, in quotes, or without blanks outside of
// parentheses. Errors: InvalidArgument with the place.
absl::StatusOr<std::vector<Definition>> DefinitionsOf(const DeckLine& line, std::size_t offset);

// Without blanks at both ends.
std::string Trimmed(std::string_view text);
// Without braces or single quotes around it, if there are any.
std::string WithoutBraces(std::string_view text);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_WORDS_H_
