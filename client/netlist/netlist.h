// SPDX-License-Identifier: Apache-2.0
// SPICE decks as problem files.

#ifndef DLCS_CLIENT_NETLIST_NETLIST_H_
#define DLCS_CLIENT_NETLIST_NETLIST_H_

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_options.h"
#include "core/circuits/relay.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

struct Netlist {
  std::string title;
  v1::Problem problem;             // with the outputs that the deck asks for, else all
  std::vector<std::string> notes;  // what was ignored or assumed, for the user
  v1::SolveOptions tolerances;     // those of its .options, for WithTolerances()
  std::vector<Relay> relays;       // for AddSlidingConcerns(); parts of an expression have the name of the whole
};

// Whether the file `text` at `path` is a deck: by its ending .cir, .net, .sp, .ckt or .spice, or because it is no JSON
// and a line begins with .tran.
bool IsDeck(const std::string& text, const std::string& path);

// The folder of the deck at `path`, for its includes; empty for `-`.
std::string FolderOfDeck(const std::string& path);

// The deck `text`, which has no .step, as a problem. `source` is its name for messages, `folder` that of its includes,
// empty for none. Errors: those of ReadDeck() and MakeCircuitProblem(), as InvalidArgument.
absl::StatusOr<Netlist> ReadNetlist(const std::string& text, const std::string& source, const std::string& folder,
                                    const DeckOptions& options);
// The points of its .step, as netlists with the label "R=10"; one without a label where it has none. Errors: as above,
// with the label.
struct SweptNetlist {
  std::string label;
  Netlist netlist;
};
absl::StatusOr<std::vector<SweptNetlist>> ReadSweep(const std::string& text, const std::string& source,
                                                    const std::string& folder, const DeckOptions& options);

// ReadNetlist() for the file at `path`, `-` for standard input.
absl::StatusOr<Netlist> ReadNetlistFile(const std::string& path, const DeckOptions& options);

// `options` with the tolerances that the deck of `problem` writes, as far as they give none of their own: steps or a
// tolerance take the place of reltol, a number for all components that of abstol and vntol, and that of a component the
// one of the deck for it.
v1::SolveOptions WithTolerances(v1::SolveOptions options, const v1::SolveOptions& of_deck, const v1::Problem& problem);

// The problem file.
nlohmann::ordered_json NetlistJson(const Netlist& netlist);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_NETLIST_H_
