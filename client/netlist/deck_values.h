// SPDX-License-Identifier: Apache-2.0
// The values of words, and the parameters and functions that a deck defines.

#ifndef DLCS_CLIENT_NETLIST_DECK_VALUES_H_
#define DLCS_CLIENT_NETLIST_DECK_VALUES_H_

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_words.h"
#include "client/netlist/spice_expression.h"

namespace dlcs::client {

// What was ignored or assumed, each once.
class DeckNotes {
 public:
  explicit DeckNotes(std::vector<std::string> notes = {}) : notes_(std::move(notes)) {}
  void Add(std::string note);
  std::vector<std::string> Take() && { return std::move(notes_); }

 private:
  std::vector<std::string> notes_;
};

// A word that is a number or an expression in braces. Errors: InvalidArgument with the place.
absl::StatusOr<double> ValueOf(const DeckLine& line, const DeckWord& word, ParameterScope& scope, DeckNotes& notes);

// What `lines`, of .param and .func, define in `scope`; the parameters `given` keep the value that they have there.
// Errors: InvalidArgument with the place, of definitions that are wrong or there twice.
absl::Status DefineParameters(const std::vector<const DeckLine*>& lines, const std::set<std::string>& given,
                              ParameterScope& scope);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_VALUES_H_
