// SPDX-License-Identifier: Apache-2.0
// Where a circuit starts that is at rest.

#ifndef DLCS_CORE_CIRCUITS_OPERATING_POINT_H_
#define DLCS_CORE_CIRCUITS_OPERATING_POINT_H_

#include "absl/status/statusor.h"
#include "core/circuits/circuit.h"
#include "core/circuits/circuit_branches.h"
#include "core/types.h"

namespace dlcs {

// The voltages of capacitors and currents of inductors, in the order of `graph.storages`, of the circuit at rest: no
// current in capacitors, no voltage across inductors, the sources as they are at 0 (`source_values`, in the order of
// `graph.sources`), `circuit.node_voltages` held. The diodes make it a linear complementarity problem. A voltage of
// `circuit.node_voltages` that a controlled source sets is not held; it chooses among several solutions.
//
// Errors: InvalidArgument with the elements if nothing determines a voltage or a current (a node behind capacitors
// alone, a loop of inductors), if the problem has no solution or none with a given voltage, or if its solutions differ
// in a capacitor or inductor. Nothing is added to make it unique.
absl::StatusOr<Vector> FindOperatingPoint(const Circuit& circuit, const CircuitBranches& graph,
                                          const Vector& source_values);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_OPERATING_POINT_H_
