// SPDX-License-Identifier: Apache-2.0
// Sweeps of parameters: .step.

#ifndef DLCS_CLIENT_NETLIST_DECK_STEPS_H_
#define DLCS_CLIENT_NETLIST_DECK_STEPS_H_

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_values.h"

namespace dlcs::client {

// The values that a parameter takes.
struct ParameterStep {
  std::string name;   // in small letters
  std::string shown;  // as it is written
  std::vector<double> values;
};

// .step param NAME FIRST LAST STEP, .step param NAME list VALUE ..., .step dec|oct param NAME FIRST LAST POINTS, with
// POINTS for each decade or octave. Errors: InvalidArgument with the place: another form, more than 10,000 values.
absl::StatusOr<ParameterStep> ReadStep(const DeckLine& line, ParameterScope& scope, DeckNotes& notes);

// A point of a sweep: parameters by name, and "R=10, C=1e-06".
struct SweepPoint {
  std::map<std::string, double> parameters;
  std::string label;
};

// All combinations; the values of the first step change fastest. Errors: InvalidArgument if there are more than 10,000.
absl::StatusOr<std::vector<SweepPoint>> PointsOf(const std::vector<ParameterStep>& steps);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_STEPS_H_
