// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_CORE_PROBLEM_FORMULA_PARAMETERS_H_
#define DLCS_CORE_PROBLEM_FORMULA_PARAMETERS_H_

#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace dlcs {

// Named numbers that formulas may use.
using FormulaParameters = std::map<std::string, double, std::less<>>;

// Why `name` is not allowed for a parameter; empty if it is. A name is a letter or _ followed by letters, digits and _.
// It must not be t, pi, e, a function, or x or y with a number (a state or constraint).
std::string FaultOfParameterName(std::string_view name);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_PARAMETERS_H_
