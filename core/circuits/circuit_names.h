// SPDX-License-Identifier: Apache-2.0
// Elements and nodes in messages about a circuit.

#ifndef DLCS_CORE_CIRCUITS_CIRCUIT_NAMES_H_
#define DLCS_CORE_CIRCUITS_CIRCUIT_NAMES_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/circuits/circuit.h"
#include "core/circuits/circuit_branches.h"
#include "core/circuits/linear_network.h"

namespace dlcs {

// "C1 (buck.cir:7)", or the name alone where the place is unknown.
std::string WithPlace(const Element& element);

// The elements of `branches`, each once: "V1 (a.cir:2), C1 (a.cir:3) and C2 (a.cir:4)".
std::string ElementsOf(const std::vector<Index>& branches, const CircuitBranches& graph, const Circuit& circuit);

// What is wrong, as InvalidArgument. `at_start` for the network of the operating point, in which inductors are shorts
// and capacitors are open.
absl::Status StatusOfFault(const NetworkFault& fault, const CircuitBranches& graph, const Circuit& circuit,
                           bool at_start);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_CIRCUIT_NAMES_H_
