// SPDX-License-Identifier: Apache-2.0
// Which line of a deck is what.

#ifndef DLCS_CLIENT_NETLIST_DECK_PARTS_H_
#define DLCS_CLIENT_NETLIST_DECK_PARTS_H_

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_words.h"

namespace dlcs::client {

constexpr int kMaxSubcircuitDepth = 32;

struct DeckModel {
  std::string type;  // in small letters: d, sw, csw
  NamedWords values;
  const DeckLine* line = nullptr;
  std::size_t offset = 0;
};

struct DeckBody;

struct DeckSubcircuit {
  std::string name;
  std::vector<std::string> ports;  // in small letters
  std::vector<DeckWord> defaults;  // name, value, name, value, ...
  const DeckLine* line = nullptr;
  std::shared_ptr<DeckBody> body;
};

// What is defined between .subckt and .ends, or in the deck outside of all. Names are in small letters.
struct DeckBody {
  std::vector<const DeckLine*> elements;
  std::vector<const DeckLine*> parameters;  // .param and .func
  std::vector<const DeckLine*> initial;     // .ic
  std::map<std::string, DeckModel> models;
  std::map<std::string, DeckSubcircuit> subcircuits;
};

// Pointers are to the lines of the deck.
struct DeckParts {
  DeckBody top;
  const DeckLine* tran = nullptr;
  std::vector<const DeckLine*> outputs, measurements;  // .print, .plot, .probe and .save; .meas
  std::vector<const DeckLine*> steps;                  // .step
  std::vector<const DeckLine*> options;                // .options
  std::set<std::string> globals;                       // nodes, in small letters
  bool sets_temperature = false;                       // by .temp or .options
  std::vector<std::string> notes;                      // what is ignored
};

// Errors: InvalidArgument with the place, of a command that is not known, definitions that are there twice, not closed,
// or nested too deep.
absl::StatusOr<DeckParts> SortDeck(const DeckText& text);

// A note that line 1 is not read, if it looks like an element or a command; otherwise empty.
std::string NoteOnTitle(const std::string& title);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_PARTS_H_
