// SPDX-License-Identifier: Apache-2.0
// Problem files with dense matrices whose sources are sums of constants, waves, powers and exponentials.

#ifndef DLCS_TESTS_HOSTILE_CASE_FILE_H_
#define DLCS_TESTS_HOSTILE_CASE_FILE_H_

#include <string>
#include <vector>

#include "tests/hostile/system.h"

namespace dlcs::hostile {

struct CaseFile {
  System system;
  struct Expected {
    double time;
    Eigen::VectorXd x;
  };
  std::vector<Expected> expected;  // "refs" of the file
  double accuracy = 1e-12;         // of these, relative: "reference_accuracy" of the file
};

// The names of the files in tests/hostile/cases, without their ending.
std::vector<std::string> CaseNames();
// Throws std::runtime_error if a source is anything else.
CaseFile ReadCase(const std::string& name);

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_CASE_FILE_H_
