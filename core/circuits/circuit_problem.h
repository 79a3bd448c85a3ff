// SPDX-License-Identifier: Apache-2.0
// A circuit as a differential linear complementarity system.

#ifndef DLCS_CORE_CIRCUITS_CIRCUIT_PROBLEM_H_
#define DLCS_CORE_CIRCUITS_CIRCUIT_PROBLEM_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/circuits/circuit.h"
#include "core/circuits/relay.h"
#include "core/problem/outputs.h"
#include "core/problem/problem.h"
#include "core/problem/time_function.h"

namespace dlcs {

// Outputs of a circuit, x_factors x + y_factors y + sources(t), a row for each name.
struct CircuitOutputs {
  std::vector<std::string> names;  // v(node) for each node but ground, i(element) for each element
  Matrix x_factors, y_factors;
  TimeFunction sources;
};

// The largest current of a switch in this model. A solution that reaches it does not describe the circuit.
struct CurrentLimit {
  std::string output;  // i(S1)
  double amperes = 0;
};

struct CircuitProblem {
  Problem problem;
  // v_C1: volts, i_L1: amperes. v0_C1, i0_L1: the same without the part that follows the sources, if C1 is in a loop of
  // capacitors and sources (or L1 in a cutset of inductors and sources).
  std::vector<std::string> state_names;
  // D1: a diode; S1_forward, S1_backward: the valves of a switch; D1_breakdown.
  std::vector<std::string> pair_names;
  CircuitOutputs outputs;
  std::vector<CurrentLimit> limits;
  std::vector<Relay> relays;
  std::vector<std::string> notes;  // assumptions, one sentence each
};

// The states are the voltages of the capacitors in a normal tree and the currents of the inductors off it. A capacitor
// in a loop of capacitors and voltage sources, and an inductor in a cutset of inductors and current sources, follows
// from states x and sources s: z = T x + Θ s. With the capacitances and inductances D and the currents and voltages
// that drive them,
//
//     Π D (T x + Θ s)' = H x + K y + S s,      x~ = x + Γ s,   Γ = (Π D T)⁻¹ Π D Θ,
//
// x~ needs no derivative of a source, and stays continuous where a source jumps (charge and flux are kept). The pair of
// a diode is its current and its reverse voltage; whether the diode is in the tree decides which of them is y.
// Therefore no derivative of y is needed. Without controlled sources M + Mᵀ is positive semidefinite. Symmetric and
// skew parts of M are exact to the last bit.
//
// Errors: InvalidArgument with the elements: loops of voltage sources, cutsets of current sources, floating nodes,
// controls that make the equations dependent or act on dependent capacitors and inductors, switches whose control the
// circuit itself determines, coupling of 1, values out of range; and those of FindOperatingPoint().
// Cost: O(b² r) for b branches, r of them resistors or controlled sources, and O(m³) for m states.
absl::StatusOr<CircuitProblem> MakeCircuitProblem(const Circuit& circuit);

// The outputs rows · (those of `all`) + constants, without names.
Outputs CombinedOutputs(const CircuitOutputs& all, const Matrix& rows, const Vector& constants);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_CIRCUIT_PROBLEM_H_
