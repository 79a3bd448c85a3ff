// SPDX-License-Identifier: Apache-2.0
// Voltages of nodes and currents of elements, from the solution of a circuit's problem.

#ifndef DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_
#define DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/result/solve_result.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// x_factors x + y_factors y + sources(t), a row for each name.
struct NamedOutputs {
  std::vector<std::string> names;
  std::size_t shown = 0;                 // the first ones; the others are only compared with their limits
  std::map<std::string, double> limits;  // A, by name: no current of a switch can be larger
  v1::Matrix x_factors, y_factors;
  v1::TimeFunction sources;
};

// The form in a problem file, under "annotations": {"outputs": {...}}: names, and the factors of x, of y and of sources
// in one of the forms of f.
nlohmann::ordered_json OutputsJson(const NamedOutputs& outputs);
// Errors: InvalidArgument with "source: place rule".
absl::StatusOr<NamedOutputs> OutputsFromJson(const nlohmann::json& value, const std::string& source);

// The outputs at the times of `result`, on [0, horizon]; at jumps of sources the limits from the right. Errors:
// InvalidArgument where the shapes do not fit.
absl::StatusOr<OutputColumns> EvaluateOutputs(const NamedOutputs& outputs, const SolveResult& result, double horizon);

// The first currents of `columns` that reach their limit, one sentence for each switch; empty if none does. Then the
// circuit needs a current that the formulation does not allow, and the result is none of the circuit.
std::vector<std::string> ReachedLimits(const NamedOutputs& outputs, const OutputColumns& columns,
                                       const std::vector<double>& times);

// `columns` without those that are not shown.
OutputColumns ShownOutputs(const NamedOutputs& outputs, const OutputColumns& columns);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_CIRCUIT_OUTPUTS_H_
