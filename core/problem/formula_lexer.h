// SPDX-License-Identifier: Apache-2.0
// Cuts the text of a formula into tokens, and explains what is not one.

#ifndef DLCS_CORE_PROBLEM_FORMULA_LEXER_H_
#define DLCS_CORE_PROBLEM_FORMULA_LEXER_H_

#include <cstddef>
#include <string>
#include <string_view>

#include "core/problem/formula_names.h"

namespace dlcs {

struct FormulaToken {
  enum class Kind {
    kNumber,
    kName,
    kOperator,  // + - * / ** ^ < <= > >= == != ( ) ,
    kEnd,
    kInvalid,  // `text` is not part of the syntax, and `advice` says what to write instead
  };
  Kind kind = Kind::kEnd;
  std::string_view text = {};
  std::size_t position = 0;  // of the first byte, from 0
  double value = 0;          // of a number
  std::string advice = {};
};

// The token that starts at or after byte `begin` of `text`. The next token starts at token.position +
// token.text.size(). Stop after an invalid token.
FormulaToken NextFormulaToken(std::string_view text, std::size_t begin);

// The advice for a word of another language that is not a name of ours ("ln", "and", "np"): what to write
// instead, or the nearest of our names, or the list of all of them.
std::string AdviceForUnknownName(std::string_view name, const FormulaVariables& variables = {});

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_LEXER_H_
