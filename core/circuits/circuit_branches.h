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

struct CircuitBranches {
  std::vector<Branch> branches;
  std::vector<Index> element_of;  // of each branch
  Index nodes = 0;                // those of the circuit and inner ones
  std::vector<StorageBranch> storages;
  std::vector<DiodeBranch> diodes;
  std::vector<SourceBranch> sources;
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
// So the gate enters the sources alone. I is larger than every current that can flow: twice what the voltages of all
// sources and all initial ones drive through the on-resistance, plus all currents of sources and initial ones.
//
// A switch that its own voltage controls closes where a diode conducts, and becomes one with `forward` = threshold; its
// hysteresis is dropped, with a note.
CircuitBranches MakeBranches(const Circuit& circuit);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_CIRCUIT_BRANCHES_H_
