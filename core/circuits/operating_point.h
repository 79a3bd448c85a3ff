// SPDX-License-Identifier: Apache-2.0
// Where a circuit starts that is at rest.

#ifndef DLCS_CORE_CIRCUITS_OPERATING_POINT_H_
#define DLCS_CORE_CIRCUITS_OPERATING_POINT_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/circuits/circuit.h"
#include "core/circuits/circuit_branches.h"
#include "core/types.h"

namespace dlcs {

struct OperatingPoint {
  Vector storages;                 // in the order of `graph.storages`: volts of capacitors, amperes of inductors
  std::vector<std::string> notes;  // how it was chosen, where that is not obvious
};

// The circuit at rest: no current in capacitors, no voltage across inductors, the sources as they are at 0
// (`source_values`, in the order of `graph.sources`), `circuit.node_voltages` held. The diodes make it a linear
// complementarity problem. A voltage of `circuit.node_voltages` that a controlled source sets is not held; it chooses
// among several solutions.
//
// Where diodes and switches that block leave capacitors open, that solution is taken in which the squares of the
// voltages across all diodes and switches have the least sum. It is the limit of equal conductances across them that
// tend to 0: with conductances G the currents minimize what they dissipate, the content of the circuit plus G times
// that sum, and of the minimizers of the content the limit has the least sum.
//
// Errors: InvalidArgument with the elements if nothing determines a voltage or a current (a node behind capacitors
// alone, a loop of inductors), if the problem has no solution or none with a given voltage, or if its solutions still
// differ in a capacitor or inductor, or rounding hides whether they do.
absl::StatusOr<OperatingPoint> FindOperatingPoint(const Circuit& circuit, const CircuitBranches& graph,
                                                  const Vector& source_values);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_OPERATING_POINT_H_
