// SPDX-License-Identifier: Apache-2.0
// The cases of tests/cases as problems of the engine, with their reference values.

#ifndef DLCS_TESTS_SUPPORT_CASES_H_
#define DLCS_TESTS_SUPPORT_CASES_H_

#include <optional>
#include <string>
#include <vector>

#include "core/problem/problem.h"

namespace dlcs::testing {

struct Reference {
  double time;
  Vector x, y, By;
};

struct Case {
  std::string name;
  Problem problem;
  std::vector<Reference> references;
  bool y_is_unique = false;
  std::vector<std::pair<double, Vector>> state_jumps;  // time, dx
  std::optional<std::size_t> num_switchings;
  std::vector<double> switching_times;  // the first ones
  double reference_accuracy = 0;        // by how much the references change when refined
};

// The names of all files of tests/cases, in order.
std::vector<std::string> CaseNames();

// Reads tests/cases/`name`.json; fails the test when it cannot.
Case LoadCase(const std::string& name);

// Largest differences at the reference times, each relative to the largest entry over all references. The solution must
// hold every reference time.
struct CaseError {
  double x = 0;
  double By = 0;
  double y = 0;  // only where y is unique
};
CaseError ErrorOf(const Case& the_case, const std::vector<double>& times, const Matrix& x, const Matrix& y);

std::vector<double> ReferenceTimes(const Case& the_case);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_CASES_H_
