// SPDX-License-Identifier: Apache-2.0
// The systems with switches of tests/discrete, with what is known of their solutions.

#ifndef DLCS_TESTS_SUPPORT_DISCRETE_CASES_H_
#define DLCS_TESTS_SUPPORT_DISCRETE_CASES_H_

#include <optional>
#include <string>
#include <vector>

#include "core/problem/problem.h"

namespace dlcs::testing {

struct NamedFlip {
  double time = 0;
  std::string name;
  bool value = false;

  bool operator==(const NamedFlip&) const = default;
};

struct DiscreteCase {
  Problem problem;
  std::vector<NamedFlip> flips;
  bool order_is_free = false;  // of flips at one time
  std::optional<Vector> end;   // x(T)
  std::string refused;         // empty: it is solved
  double refused_at = 0;
  std::vector<std::string> names;   // of the switches that the refusal is about
  bool file_order_decides = false;  // a race at the start
};

// The names of all files of tests/discrete, in order.
std::vector<std::string> DiscreteCaseNames();
// Reads tests/discrete/`name`.json; fails the test when it cannot.
DiscreteCase LoadDiscreteCase(const std::string& name);

// The same with state i in the unit state_units[i mod its size], control i likewise, and time in another unit.
void ChangeUnits(const std::vector<double>& state_units, const std::vector<double>& control_units, double time_unit,
                 DiscreteCase& the_case);
// The same with the switches in reverse order.
void ReverseSwitches(DiscreteCase& the_case);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_DISCRETE_CASES_H_
