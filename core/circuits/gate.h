// SPDX-License-Identifier: Apache-2.0
// When a switch closes and opens whose control is known beforehand.

#ifndef DLCS_CORE_CIRCUITS_GATE_H_
#define DLCS_CORE_CIRCUITS_GATE_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/circuits/circuit.h"
#include "core/circuits/waveform.h"

namespace dlcs {

// factor times `wave`; a control is a sum of such terms.
struct ControlTerm {
  double factor = 1;
  Waveform wave;
};

// The gate of a switch, 1 where it is closed: it closes where the sum of `control` rises to threshold + hysteresis, and
// opens where it falls to threshold - hysteresis. In between it stays as it is. For one PULSE it is a pulse without
// ramps, exact for all periods; otherwise the times are those at which formulas switch
// (core/problem/formula_switching.h), correct to the last bit.
// Errors: FailedPrecondition if the times could not be found, with the reason.
absl::StatusOr<Waveform> GateOf(const std::vector<ControlTerm>& control, const SwitchModel& model, double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_GATE_H_
