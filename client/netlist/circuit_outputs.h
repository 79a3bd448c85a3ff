// SPDX-License-Identifier: Apache-2.0
// The outputs and measurements of a circuit's problem.

#ifndef DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_
#define DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_

#include <vector>

#include "client/netlist/deck.h"
#include "core/circuits/circuit_problem.h"

namespace dlcs::client {

// Volts: a voltage, or a sum or difference of some; likewise amperes.
enum class OutputUnit { kOther, kVolts, kAmperes };

// Sets outputs and measurements of `made.problem`: what `deck` prints, all voltages and currents if it prints nothing;
// and hidden ones for what it measures and for currents of switches, which have limits. Returns the units of those that
// are not hidden.
std::vector<OutputUnit> SetOutputs(const Deck& deck, CircuitProblem& made);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_
