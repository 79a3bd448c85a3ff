// SPDX-License-Identifier: Apache-2.0
// Switches and comparators of a deck that slide.

#ifndef DLCS_CLIENT_NETLIST_SLIDING_H_
#define DLCS_CLIENT_NETLIST_SLIDING_H_

#include <vector>

#include "core/circuits/relay.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Without hysteresis a switch that acts against its own control comes to rest between open and closed, where its
// control stays at the threshold: the limit of switching ever faster. The solution is then that of the equations, but
// hardly what the circuit does; with hysteresis it is none at all, and no success. Adds to the verdict of `summary`,
// the result of a solve on [0, horizon] by event_driven, a concern for each of `relays` that is in between for longer
// than rounding: its name, how long, and since when. Results of other methods have no switching times, and are not
// changed.
void AddSlidingConcerns(const std::vector<Relay>& relays, double horizon, v1::Summary& summary);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_SLIDING_H_
