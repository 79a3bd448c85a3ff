// SPDX-License-Identifier: Apache-2.0
// .meas lines of a deck.

#ifndef DLCS_CLIENT_NETLIST_MEASUREMENTS_H_
#define DLCS_CLIENT_NETLIST_MEASUREMENTS_H_

#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_circuit.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_quantities.h"
#include "client/netlist/spice_expression.h"
#include "core/problem/outputs.h"

namespace dlcs::client {

// A measurement whose lists of outputs are still quantities.
struct DeckMeasurement {
  Measurement measurement;
  DeckQuantity measured, at, until;  // without factors where there is none
};

// The measurements of `lines`:
//     .meas tran NAME AVG|RMS|INTEG|MIN|MAX|PP quantity [FROM=time] [TO=time]
//     .meas tran NAME FIND quantity AT=time
//     .meas tran NAME FIND quantity WHEN quantity=level-or-quantity [TD=time] [RISE|FALL|CROSS=number|LAST]
//     .meas tran NAME WHEN quantity=level-or-quantity [TD=time] [RISE|FALL|CROSS=number|LAST]
//     .meas tran NAME TRIG quantity VAL=level [TD=time] RISE|FALL|CROSS=number|LAST TARG ...
//     .meas tran NAME TRIG AT=time TARG ...
// `horizon` is TSTOP. Lines for other analyses are left out with a note. Errors: InvalidArgument with the place, of a
// form that is none of these, and of times outside [0, TSTOP].
absl::StatusOr<std::vector<DeckMeasurement>> ReadMeasurements(const std::vector<const DeckLine*>& lines, double horizon,
                                                              ParameterScope& scope, const DeckCircuit& circuit,
                                                              DeckNotes& notes);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_MEASUREMENTS_H_
