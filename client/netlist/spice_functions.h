// SPDX-License-Identifier: Apache-2.0
// The functions that are built into expressions of SPICE decks, of numbers and of functions of time.

#ifndef DLCS_CLIENT_NETLIST_SPICE_FUNCTIONS_H_
#define DLCS_CLIENT_NETLIST_SPICE_FUNCTIONS_H_

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "client/netlist/linear_value.h"

namespace dlcs::client {

struct SpiceFunction {
  std::size_t least, most;  // how many arguments it takes
  double (*of)(const std::vector<double>&);
};

// Null if there is not a function with this name, which is in small letters.
const SpiceFunction* FindSpiceFunction(const std::string& name);

// The function as a formula in t (core/problem/formula.h), for arguments without voltages and currents. Empty if the
// engine has no such function.
std::optional<std::string> FormulaOfCall(const std::string& name, const std::vector<LinearValue>& arguments);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_SPICE_FUNCTIONS_H_
