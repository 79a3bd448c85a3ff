// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/variable_names.h"

#include <algorithm>
#include <cctype>

#include "core/problem/formula_syntax.h"

namespace dlcs {

std::string VariableNames::Make(std::string name) {
  for (char& letter : name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  }
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) != 0) name.insert(0, "_");
  static const std::set<std::string> kWords = {"t", "pi", "e", "and", "or", "not", "in", "is", "if", "else", "lambda"};
  const bool is_function = std::any_of(kFormulaFunctions.begin(), kFormulaFunctions.end(),
                                       [&](const FormulaName& function) { return function.name == name; });
  const bool is_numbered = name.size() > 1 && (name[0] == 'x' || name[0] == 'y' || name[0] == 'w') &&
                           name.find_first_not_of("0123456789", 1) == std::string::npos;
  if (is_function || is_numbered || kWords.contains(name)) name += "_";
  while (!taken_.insert(name).second) name += "_";
  return name;
}

}  // namespace dlcs
