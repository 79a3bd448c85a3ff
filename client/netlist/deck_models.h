// SPDX-License-Identifier: Apache-2.0
// Diodes, switches, transistors and resistors from .model lines.

#ifndef DLCS_CLIENT_NETLIST_DECK_MODELS_H_
#define DLCS_CLIENT_NETLIST_DECK_MODELS_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/netlist/deck_options.h"
#include "client/netlist/deck_parts.h"
#include "client/netlist/deck_values.h"
#include "client/netlist/spice_expression.h"
#include "core/circuits/circuit.h"

namespace dlcs::client {

// A piecewise linear diode of `area` times the size, by the rule of `options`. Parameters that such a diode does not
// have are noted. Errors: InvalidArgument with the place, of parameters that are not known or have no meaning.
absl::StatusOr<DiodeModel> DiodeOf(const DeckModel& model, const std::string& name, double area,
                                   const DeckOptions& options, ParameterScope& scope, DeckNotes& notes);

// A switch.
struct SwitchKind {
  SwitchModel switching;      // for its control; for the control with the other sign if it closes below
  bool closes_below = false;  // closed where the control is low
};

// A switch that a voltage, or a current, controls. One whose resistance changes smoothly between two levels of the
// control (VSWITCH, ISWITCH; a hysteresis below 0) switches in their middle. Errors: as above.
absl::StatusOr<SwitchKind> SwitchOf(const DeckModel& model, const std::string& name, bool by_voltage,
                                    ParameterScope& scope, DeckNotes& notes);

// A field-effect transistor that is turned on and off.
struct TransistorModel {
  bool is_p = false;      // closed where the gate is below the source by the threshold
  SwitchModel switching;  // for the voltage from gate to source; from source to gate of a P-channel
  DiodeModel body_diode;  // from source to drain; from drain to source of a P-channel
};
// Its geometry: parameters of the element's line.
struct TransistorSize {
  double width_by_length = 1;
  double parallel = 1;
};

// The threshold is VTO; the on-resistance is RD + RS and that of the channel at a gate voltage of 10 V, 1/(KP W/L (10 -
// VTO)); the body diode is that of IS, N and RB by the rule of `options`. Errors: as above.
absl::StatusOr<TransistorModel> TransistorOf(const DeckModel& model, const std::string& name,
                                             const TransistorSize& size, const DeckOptions& options,
                                             ParameterScope& scope, DeckNotes& notes);

// The parameters in the line of a resistor, in addition to its model.
struct ResistorLine {
  bool has_value = false;        // ohms
  double length = 0, width = 0;  // m; 0 if missing
};

// The resistance of a model of type R or RES: R, or RSH L/W; 0 if the line has the value itself. Errors: as above, also
// if programs understand the model in different ways, or if it has a temperature coefficient and the deck another
// temperature.
absl::StatusOr<double> ResistanceOf(const DeckModel& model, const std::string& name, const ResistorLine& line,
                                    bool sets_temperature, ParameterScope& scope, DeckNotes& notes);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_MODELS_H_
