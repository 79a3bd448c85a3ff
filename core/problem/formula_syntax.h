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

#include <string_view>

#include "absl/status/statusor.h"
#include "core/problem/formula_names.h"
#include "core/problem/formula_tree.h"

namespace dlcs {

// Errors: InvalidArgument "at position P: ...", with P counted in bytes from 1, what was found there, and the rule.
// Texts longer than 65,536 bytes, or nested deeper than 100 levels of parentheses, calls and powers, are refused. Cost:
// linear in the length of `text`, about 5 µs for a short one. Safe from any thread; does not depend on the locale.
absl::StatusOr<FormulaTree> ReadFormula(std::string_view text, const FormulaVariables& variables = {});

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_SYNTAX_H_
