// SPDX-License-Identifier: Apache-2.0
// Values of expressions in SPICE decks: linear in voltages and currents, plus a function of time.

#ifndef DLCS_CLIENT_NETLIST_LINEAR_VALUE_H_
#define DLCS_CLIENT_NETLIST_LINEAR_VALUE_H_

#include <map>
#include <memory>
#include <string>

#include "core/circuits/circuit.h"

namespace dlcs::client {

// constant + Σ factor · quantity + of_time, with quantities as "v(a,b)" and "i(v1)", in small letters.
struct LinearValue {
  double constant = 0;
  std::map<std::string, double> factors = {};
  std::string of_time = "";  // a formula in t (core/problem/formula.h); empty for none
  bool is_truth = false;     // of a comparison: 0 or 1
  // If the value is a comparison that is not a quantity yet: the value that is above 0 where the comparison is 1.
  std::shared_ptr<const LinearValue> compared = nullptr;
};

// A function of time, without quantities.
bool IsOfTime(const LinearValue& value);
// A value without quantities as a formula in t, in parentheses.
std::string TextOf(const LinearValue& value);

// value + factor · other
LinearValue Sum(LinearValue value, const LinearValue& other, double factor = 1);
LinearValue Minus(const LinearValue& value, const LinearValue& other);
LinearValue Times(LinearValue value, double factor);

// function(x), for a number and for a formula `x`.
double ValueAt(const PiecewiseLinear& function, double x);
std::string TextOf(const PiecewiseLinear& function, const std::string& x);
// function(slope x + constant) for x > 0, and 0 for others, with a jump at 0; the slope is not 0.
PiecewiseLinear PartAboveZero(PiecewiseLinear function, double slope, double constant);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_LINEAR_VALUE_H_
