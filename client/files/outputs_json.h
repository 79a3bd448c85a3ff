// SPDX-License-Identifier: Apache-2.0
// The outputs and measurements of a problem file.

#ifndef DLCS_CLIENT_FILES_OUTPUTS_JSON_H_
#define DLCS_CLIENT_FILES_OUTPUTS_JSON_H_

#include <nlohmann/json.hpp>

#include "client/files/json_reader.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Reads the keys `outputs` and `measurements` of `root`, if there are any:
//     "outputs": {"names": ["v(out)", ...], "C": [[...], ...], "D": [[...], ...], "h": ["12*sin(t)", ...],
//                 "hidden": 1, "limits": {"i(S1)": 50}}
// with C and D in a form of matrix_json.h and h in one of time_function_json.h, each zero when missing; and
//     "measurements": [{"name": "mean", "kind": "average", "outputs": ["v(out)"], "begin": 0, "end": 1},
//                      {"name": "rise", "kind": "time", "at": {"outputs": ["v(out)"], "level": 5,
//                       "direction": "rising", "number": 1, "after": 0}},
//                      {"name": "at 1", "kind": "value", "outputs": ["v(out)"], "at": {"time": 1}}]
void ReadOutputs(const nlohmann::json& root, JsonReader& reader, v1::Problem& problem);

// The same keys for a valid `problem`, set in `file`.
void WriteOutputs(const v1::Problem& problem, nlohmann::ordered_json& file);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_OUTPUTS_JSON_H_
