// SPDX-License-Identifier: Apache-2.0
// The sources f and g of a problem file.

#ifndef DLCS_CLIENT_TIME_FUNCTION_JSON_H_
#define DLCS_CLIENT_TIME_FUNCTION_JSON_H_

#include <nlohmann/json.hpp>

#include "client/json_reader.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Reads f and g from the keys `f`, `g` and `pieces` of `root`, each in one of these forms:
//     ["sin(t)", 2.5]                                   a formula or a number per component
//     {"times": [t_0, ...], "values": [[...], ...]}     samples, one row per time
//     {"breaks": [...], "coefficients": [p_0, ...]}     piecewise polynomials; p_i is a list of rows, row k
//                                                       the factors of (t - breaks[i])^k
//     "pieces": [{"t0": 0, "f": ..., "g": ...}, ...]    replaces both; each holds from its t0 to the next
// What is missing is zero, of `states` respectively `constraints` components.
void ReadSources(const nlohmann::json& root, int states, int constraints, JsonReader& reader,
                 v1::TimeFunction& f, v1::TimeFunction& g);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_TIME_FUNCTION_JSON_H_
