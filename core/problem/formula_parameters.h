// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_CORE_PROBLEM_FORMULA_PARAMETERS_H_
#define DLCS_CORE_PROBLEM_FORMULA_PARAMETERS_H_

#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace dlcs {

// Numbers that formulas may call by a name.
using FormulaParameters = std::map<std::string, double, std::less<>>;

// Why `name` is none for a parameter: empty where it is one. It is a letter or _ and then letters, digits and _, is not
// t, pi, e or a function, and not x or y with a number, which are states and constraints.
std::string FaultOfParameterName(std::string_view name);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_PARAMETERS_H_
