// SPDX-License-Identifier: Apache-2.0
// A circuit as a graph: every element becomes branches, every diode and switch ideal diodes.

#ifndef DLCS_CORE_CIRCUITS_CIRCUIT_BRANCHES_H_
#define DLCS_CORE_CIRCUITS_CIRCUIT_BRANCHES_H_

#include <string>
#include <vector>

#include "core/circuits/circuit.h"
#include "core/circuits/linear_network.h"
#include "core/types.h"

namespace dlcs {

// In which order the tree takes branches: the normal tree. Diodes and switches before high resistances, so
// that blocking ones do not make fast states; valves of switches after diodes, so that the current of a switch is y
// where the circuit allows.
enum TreeOrder {
  kSourceOrder,
  kControlledOrder,
  kCapacitorOrder,
  kResistorOrder,
  kDiodeOrder,
  kValveOrder,
  kHighOrder,
  kLastOrder
};

// A capacitor or an inductor.
struct StorageBranch {
  Index element = 0, branch = 0;
  bool is_capacitor = false;
};

// An ideal diode: current >= 0 from plus to minus, voltage <= 0.
struct DiodeBranch {
  Index element = 0, branch = 0;
  std::string name;
};

// A branch whose voltage or current is scale times a waveform.
struct SourceBranch {
  Index element = 0, branch = 0;
  double scale = 1;
  Waveform wave = {};
  bool is_gate = false;  // the waveform is the gate of the switch `element`, which is found later
};

// A quantity between two bounds, one of which may be missing: the voltage of a node to ground, which the diode `low`
// holds above the lower bound and `high` below the upper one.
struct ClampBranches {
  Index element = 0;
  Index node = 0;
  Index low = -1, high = -1;  // of `diodes`; -1 if there is none
  bool is_gate = false;       // of a switch that the circuit controls
  bool is_jump = false;       // from one bound to the other one at once
};

struct CircuitBranches {
  std::vector<Branch> branches;
  std::vector<Index> element_of;  // of each branch
  Index nodes = 0;                // those of the circuit and inner ones
  std::vector<StorageBranch> storages;
  std::vector<DiodeBranch> diodes;
  std::vector<SourceBranch> sources;
  std::vector<ClampBranches> clamps;
  // The branches whose currents add up to that of each element, from its plus to its minus.
  struct Part {
    Index branch = 0;
    double sign = 1;
  };
  std::vector<std::vector<Part>> parts;
  // The largest current I of a switch, A.
  struct Limit {
    Index element = 0;
    double amperes = 0;
  };
  std::vector<Limit> limits;
  // Of each inductor that is coupled by 1 to another one, which carries the flux of both: that one, and its voltage by
  // the voltage of that one. Of all other elements: themselves, and 1.
  struct Winding {
    Index base = 0;
    double ratio = 1;
  };
  std::vector<Winding> windings;
  std::vector<std::string> notes;
};

// A diode is a voltage source `forward`, its on-resistance and an ideal diode in series, with the off-resistance across
// them, and its breakdown the same backwards.
//
// A switch is its on-resistance in series with two one-way valves, one for each direction, and the off-resistance
// across them. A valve for the current i is a current source I u(t) beside an ideal diode that carries I u - i back:
//
//     0 <= v ⟂ I u - i >= 0,      u = 0 or 1, the gate.
//
// So the gate enters the sources alone. I shall be larger than every current that flows: `current_limit` of the circuit
// times twice what the voltages of all sources and all initial ones drive through the on-resistance, plus all currents
// of sources and initial ones. Where inductors make higher voltages it may be too small, and a larger factor helps.
//
// A switch that the circuit itself controls has as u the voltage of a node between 0 and 1 V, into which a current of
// control - threshold - hysteresis + 2 hysteresis u flows: it is 1 while that is positive, 0 while it is negative.
//
// A piecewise linear transfer function is a sum of such voltages: between two points the node has a resistance that is
// the slope, at a jump it has none.
//
// Inductors that are coupled by 1 are the first of them, the base, and an ideal transformer beside it: its windings
// have the ratio √(L/L base). The winding `ports[base]` gets its current from the others, and they their voltages from
// it. Which one that may be depends on what is in series and in parallel with them.
//
// A switch that its own voltage controls closes where a diode conducts, and becomes one with `forward` = threshold; its
// hysteresis is dropped, with a note. If threshold > hysteresis > 0 it ignites instead, as a glow lamp does, and
// remains a switch. A body diode is beside the valves. `in_loop` tells which switches the circuit itself controls, by
// element; the gates of the others are sources. By default the ports are the bases.
CircuitBranches MakeBranches(const Circuit& circuit, const std::vector<bool>& in_loop,
                             const std::vector<Index>& ports = {});

// Removes what rounding left of reciprocity in M: it is symmetric between pairs of the same kind (y both currents, sign
// 1, or both reverse voltages, -1) and skew between others. Without controlled sources all entries are made so,
// otherwise those that are but for rounding. An entry of 1e-16 beside a zero of the diagonal would make M indefinite.
void MakeReciprocal(const CircuitBranches& graph, const Vector& sign, Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_CIRCUIT_BRANCHES_H_
