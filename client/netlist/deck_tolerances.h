// SPDX-License-Identifier: Apache-2.0
// The tolerances that `.options` of a deck writes.

#ifndef DLCS_CLIENT_NETLIST_DECK_TOLERANCES_H_
#define DLCS_CLIENT_NETLIST_DECK_TOLERANCES_H_

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_values.h"
#include "client/netlist/spice_expression.h"

namespace dlcs::client {

// Absent where the deck does not write them: the defaults of ngspice (1e-3, 1e-12 A and 1e-6 V) would excuse a signal
// of 1 µV.
struct DeckTolerances {
  std::optional<double> relative;     // reltol
  std::optional<double> of_currents;  // abstol, A
  std::optional<double> of_voltages;  // vntol, V
};

// The last value of each counts, as in ngspice. What else `lines` set is ignored with a note. Errors: InvalidArgument
// with the place, of a value that no tolerance can have.
absl::StatusOr<DeckTolerances> ReadTolerances(const std::vector<const DeckLine*>& lines, ParameterScope& scope,
                                              DeckNotes& notes);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_TOLERANCES_H_
