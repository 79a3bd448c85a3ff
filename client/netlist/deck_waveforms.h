// SPDX-License-Identifier: Apache-2.0
// The functions of independent sources: PULSE, SIN, PWL, EXP, SFFM, AM.

#ifndef DLCS_CLIENT_NETLIST_DECK_WAVEFORMS_H_
#define DLCS_CLIENT_NETLIST_DECK_WAVEFORMS_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "client/netlist/deck_fields.h"
#include "client/netlist/deck_values.h"
#include "core/circuits/waveform.h"

namespace dlcs::client {

// The defaults of SPICE for missing numbers.
struct WaveformDefaults {
  double step = 0;  // TSTEP
  double stop = 0;  // TSTOP
  bool ideal_edges = false;
};

// Whether `lower` names one of these functions.
bool IsWaveform(const std::string& lower);

// The function that begins with word `k`, with its numbers in parentheses or without; `k` is moved after it. Errors:
// InvalidArgument with the place.
absl::StatusOr<Waveform> ReadWaveform(const DeckFields& fields, std::size_t& k, const WaveformDefaults& defaults,
                                      ParameterScope& scope, DeckNotes& notes);

// The source that LTspice turns on within the first 20 us ("startup"): `wave` times min(1, t/20 us).
Waveform TurnedOn(const Waveform& wave, double horizon);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_WAVEFORMS_H_
