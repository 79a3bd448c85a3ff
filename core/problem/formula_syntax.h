// SPDX-License-Identifier: Apache-2.0
// The grammar of formulas in `t`, and for nonlinear problems in states x1 ... xm and constraints y1 ... yn. It agrees
// with Python.
//
//     comparison := sum (("<" | "<=" | ">" | ">=" | "==" | "!=") sum)*
//     sum        := product (("+" | "-") product)*
//     product    := signed (("*" | "/") signed)*
//     signed     := ("+" | "-")* power
//     power      := primary (("**" | "^") signed)?
//     primary    := number | "t" | "pi" | "e" | parameter | "x" index | "y" index
//                 | function "(" comparison ("," comparison)* ")" | "(" comparison ")"
//
// A chain a < b <= c is the product of its comparisons; each operand is evaluated once.

#ifndef DLCS_CORE_PROBLEM_FORMULA_SYNTAX_H_
#define DLCS_CORE_PROBLEM_FORMULA_SYNTAX_H_

#include <array>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
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

// Errors: InvalidArgument "at position P: ...", with P counted in bytes from 1, what was found there, and the rule.
// Texts longer than 65,536 bytes, or nested deeper than 100 levels of parentheses, calls and powers, are refused. Cost:
// linear in the length of `text`, about 5 µs for a short one. Safe from any thread; does not depend on the locale.
absl::StatusOr<FormulaTree> ReadFormula(std::string_view text, const FormulaVariables& variables = {});

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_SYNTAX_H_
