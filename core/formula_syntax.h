// SPDX-License-Identifier: Apache-2.0
// The grammar of formulas in `t`, and in states x1 ... xm and constraints y1 ... yn where there are any: reads a text
// as Python reads it and writes it again in the part of muParser's language on which both agree.
//
//     comparison := sum (("<" | "<=" | ">" | ">=" | "==" | "!=") sum)*
//     sum        := product (("+" | "-") product)*
//     product    := signed (("*" | "/") signed)*
//     signed     := ("+" | "-")* power
//     power      := primary (("**" | "^") signed)?
//     primary    := number | "t" | "pi" | "e" | "x" index | "y" index | function "(" comparison ("," comparison)* ")"
//                 | "(" comparison ")"
//
// muParser's own reading differs in places (`**`, --t, a < b < c) and is wider in others (assignments, `?:`,
// lists), so nothing reaches it that was not read here first.

#ifndef DLCS_CORE_FORMULA_SYNTAX_H_
#define DLCS_CORE_FORMULA_SYNTAX_H_

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "core/types.h"

namespace dlcs {

struct FormulaName {
  std::string_view name;
  bool takes_many;  // one argument or more, instead of exactly one
};

inline constexpr std::array<FormulaName, 19> kFormulaFunctions = {{
    {"sin", false},   {"cos", false},   {"tan", false},  {"asin", false}, {"acos", false},
    {"atan", false},  {"sinh", false},  {"cosh", false}, {"tanh", false}, {"exp", false},
    {"log", false},   {"log10", false}, {"sqrt", false}, {"abs", false},  {"sign", false},
    {"floor", false}, {"ceil", false},  {"min", true},   {"max", true},
}};

// A chained comparison a < b <= c is written chain(a, kLess, b, kLessEqual, c): each operand once, as Python
// evaluates it. (The product (a < b)*(b <= c) would double the text with every level of nesting.)
inline constexpr std::string_view kChainFunction = "chain";
enum class Comparison { kLess, kLessEqual, kGreater, kGreaterEqual, kEqual, kNotEqual };

// The variables besides t: x1 ... x`states` and y1 ... y`constraints`.
struct FormulaVariables {
  Index states = 0;
  Index constraints = 0;
};

struct FormulaSyntax {
  std::string muparser_text;
  bool depends_on_t = false;
  // Indices from 0 of the x and y in the text, each once, in the order of their first occurrence.
  std::vector<Index> states;
  std::vector<Index> constraints;
  std::vector<std::string_view>
      functions;  // each name of kFormulaFunctions in the text once, and kChainFunction
};

// Errors: InvalidArgument "at position P: ...", with P counted in bytes from 1, what was found there, and the
// rule. Longer than 65,536 bytes, or nested deeper than 100 levels of parentheses, calls and powers, is
// refused. Cost: linear in the length of `text` times its depth. Safe from any thread; no locale matters.
absl::StatusOr<FormulaSyntax> ReadFormula(std::string_view text, FormulaVariables variables = {});

}  // namespace dlcs

#endif  // DLCS_CORE_FORMULA_SYNTAX_H_
