// SPDX-License-Identifier: Apache-2.0
// The names that a formula may use.

#ifndef DLCS_CORE_PROBLEM_FORMULA_NAMES_H_
#define DLCS_CORE_PROBLEM_FORMULA_NAMES_H_

#include <array>
#include <string_view>

#include "core/problem/formula_parameters.h"
#include "core/problem/formula_tree.h"
#include "core/types.h"

namespace dlcs {

struct FormulaName {
  std::string_view name;
  FormulaOperation operation;
  bool takes_many = false;  // one argument or more, instead of exactly one
};

inline constexpr std::array<FormulaName, 19> kFormulaFunctions = {{
    {"sin", FormulaOperation::kSin},       {"cos", FormulaOperation::kCos},   {"tan", FormulaOperation::kTan},
    {"asin", FormulaOperation::kAsin},     {"acos", FormulaOperation::kAcos}, {"atan", FormulaOperation::kAtan},
    {"sinh", FormulaOperation::kSinh},     {"cosh", FormulaOperation::kCosh}, {"tanh", FormulaOperation::kTanh},
    {"exp", FormulaOperation::kExp},       {"log", FormulaOperation::kLog},   {"log10", FormulaOperation::kLog10},
    {"sqrt", FormulaOperation::kSqrt},     {"abs", FormulaOperation::kAbs},   {"sign", FormulaOperation::kSign},
    {"floor", FormulaOperation::kFloor},   {"ceil", FormulaOperation::kCeil}, {"min", FormulaOperation::kMin, true},
    {"max", FormulaOperation::kMax, true},
}};

// The names besides t: x1 ... x`states`, y1 ... y`constraints`, and the parameters.
struct FormulaVariables {
  Index states = 0;
  Index constraints = 0;
  FormulaParameters parameters = {};
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_NAMES_H_
