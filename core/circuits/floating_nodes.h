// SPDX-License-Identifier: Apache-2.0
// Nodes that only diodes and switches join to the others.

#ifndef DLCS_CORE_CIRCUITS_FLOATING_NODES_H_
#define DLCS_CORE_CIRCUITS_FLOATING_NODES_H_

#include <string>
#include <vector>

#include "core/circuits/circuit.h"

namespace dlcs {

// One sentence for each part of the circuit that has no path to ground while diodes and switches block, and into which
// no source drives a current: its potential is then any that keeps them blocked.
std::vector<std::string> NotesOnFloatingNodes(const Circuit& circuit);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_FLOATING_NODES_H_
