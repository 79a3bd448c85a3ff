// SPDX-License-Identifier: Apache-2.0
// The outputs and measurements of a circuit's problem.

#ifndef DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_
#define DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_

#include "client/netlist/deck.h"
#include "core/circuits/circuit_problem.h"

namespace dlcs::client {

// Sets outputs and measurements of `made.problem`: what `deck` prints, all voltages and currents if it prints nothing;
// and hidden ones for what it measures and for currents of switches, which have limits.
void SetOutputs(const Deck& deck, CircuitProblem& made);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_
