// SPDX-License-Identifier: Apache-2.0
// The words of an element's line: those by position, and name=value.

#ifndef DLCS_CLIENT_NETLIST_DECK_FIELDS_H_
#define DLCS_CLIENT_NETLIST_DECK_FIELDS_H_

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_words.h"

namespace dlcs::client {

struct DeckFields {
  const DeckLine* line = nullptr;
  std::vector<DeckWord> words;  // the name of the element first
  NamedWords named;

  // "buck.cir:7:12" of word `k`, of the last one where there are fewer.
  std::string Place(std::size_t k) const;
};

// Errors: InvalidArgument with the place.
absl::StatusOr<DeckFields> FieldsOf(const DeckLine& line);

// Errors: InvalidArgument if there are fewer than `count` words; `form` is how such a line is written.
absl::Status NeedWords(const DeckFields& fields, std::size_t count, const std::string& form);
// Errors: InvalidArgument if there are more than `used` words, or names other than `names`.
// "; no blank stands before a suffix or unit, as in 5V", where word `k` may be one of the number before it; or empty.
std::string HintOnBlank(const DeckFields& fields, std::size_t k);

absl::Status RefuseRest(const DeckFields& fields, std::size_t used, const std::set<std::string>& names);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_FIELDS_H_
