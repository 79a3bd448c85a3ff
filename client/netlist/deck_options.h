// SPDX-License-Identifier: Apache-2.0
// How SPICE decks are read.

#ifndef DLCS_CLIENT_NETLIST_DECK_OPTIONS_H_
#define DLCS_CLIENT_NETLIST_DECK_OPTIONS_H_

#include <map>
#include <string>

namespace dlcs::client {

// How the exponential of a `.model D` becomes a line.
enum class DiodeRule {
  kTangent,    // the tangent at `diode_current`: the forward voltage is where it meets no current, its slope the
               // resistance
  kPiecewise,  // chords between a hundredth, a tenth, once and ten times `diode_current`
  kIdeal,      // no voltage and no resistance
};

struct DeckOptions {
  DiodeRule diode = DiodeRule::kTangent;
  double diode_current = 1;                       // A
  std::map<std::string, double> parameters = {};  // values of .param, by name in small letters, in place of the deck's
  double current_limit = 1;  // times the largest currents that switches are given, see core/circuits/circuit_branches
  bool ideal_edges = false;  // a missing or zero rise or fall time of PULSE is a jump, not TSTEP
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_OPTIONS_H_
