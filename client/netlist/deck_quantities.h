// SPDX-License-Identifier: Apache-2.0
// Voltages, currents and expressions of them that a deck asks for.

#ifndef DLCS_CLIENT_NETLIST_DECK_QUANTITIES_H_
#define DLCS_CLIENT_NETLIST_DECK_QUANTITIES_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_circuit.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/spice_expression.h"

namespace dlcs::client {

// A product of linear functions of voltages and currents, such as V(in)*I(V1); of one for most.
struct DeckQuantity {
  std::string text;  // as it was written
  std::vector<LinearValue> factors;
};

// A word of .print or .meas: separated by blanks and commas outside of parentheses, braces and quotes; "=" is one.
struct DeckItem {
  std::string text;
  std::size_t offset = 0;  // in the line
};
std::vector<DeckItem> ItemsOf(const DeckLine& line);

// The quantity that `item` writes: V(a), V(a,b), I(R1), @r1[i], V1#branch, or an expression of these, bare, in braces,
// in quotes or as par('...'). Errors: InvalidArgument with the place: a node or element that `circuit` does not have,
// and what is neither linear nor a product of linear functions.
absl::StatusOr<DeckQuantity> QuantityOf(const DeckLine& line, const DeckItem& item, ParameterScope& scope,
                                        const DeckCircuit& circuit);

// What .print, .plot, .probe and .save ask for, in `lines`; nothing if it is everything. Lines for other analyses than
// .tran are left out with a note. Errors: those of QuantityOf(), and for a product.
absl::StatusOr<std::vector<DeckQuantity>> PrintedQuantities(const std::vector<const DeckLine*>& lines,
                                                            ParameterScope& scope, const DeckCircuit& circuit,
                                                            DeckNotes& notes);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_QUANTITIES_H_
