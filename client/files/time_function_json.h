// SPDX-License-Identifier: Apache-2.0
// The sources f and g of a problem file.

#ifndef DLCS_CLIENT_FILES_TIME_FUNCTION_JSON_H_
#define DLCS_CLIENT_FILES_TIME_FUNCTION_JSON_H_

#include <nlohmann/json.hpp>
#include <string>

#include "client/files/json_reader.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Reads f and g from the keys `f`, `g` and `pieces` of `root`, each in one of these forms:
//     ["sin(t)", 2.5]                                   a formula or a number per component
//     {"times": [t_0, ...], "values": [[...], ...]}     samples, one row per time
//     {"breaks": [...], "coefficients": [p_0, ...]}     piecewise polynomials; p_i is a list of rows, row k
//                                                       the factors of (t - breaks[i])^k
//     "pieces": [{"t0": 0, "f": ..., "g": ...}, ...]    in place of both, never beside them;
//                                                       each holds from its t0 to the next
// f and g themselves may also be
//     {"matrix": F, "of": s}                            F (a matrix as in matrix_json.h) times s, which has one
//                                                       of the first three forms
//     {"pieces": [{"t0": 0, "of": s}, ...]}             pieces of this function alone; with "matrix", F times them
// A missing function is zero, with `states` or `constraints` components.
void ReadSources(const nlohmann::json& root, int states, int constraints, JsonReader& reader, v1::TimeFunction& f,
                 v1::TimeFunction& g);

// Reads the function of `size` components that `object` has under `key`, in one of these forms except "pieces" in place
// of f and g; it is zero if there is no such key. `prefix` precedes the key in messages.
void ReadFunction(const nlohmann::json& object, const std::string& key, const std::string& prefix, int size,
                  JsonReader& reader, v1::TimeFunction& function);

// A valid function of `size` components in the form that ReadSources() reads; null if it is zero.
nlohmann::ordered_json SourceJson(const v1::TimeFunction& function, int size);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_TIME_FUNCTION_JSON_H_
