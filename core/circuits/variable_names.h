// SPDX-License-Identifier: Apache-2.0
// Names of states and pairs.

#ifndef DLCS_CORE_CIRCUITS_VARIABLE_NAMES_H_
#define DLCS_CORE_CIRCUITS_VARIABLE_NAMES_H_

#include <set>
#include <string>

namespace dlcs {

// Makes names of letters, digits and _ alone, none that formulas reserve, and none twice.
class VariableNames {
 public:
  std::string Make(std::string name);

 private:
  std::set<std::string> taken_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_VARIABLE_NAMES_H_
