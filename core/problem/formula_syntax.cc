// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_syntax.h"

#include <algorithm>
#include <charconv>
#include <numbers>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "core/problem/formula_lexer.h"

namespace dlcs {
namespace {

using Kind = FormulaToken::Kind;

constexpr std::size_t kMaxTextSize = 64 * 1024;
// This depth is enough for any formula that a person or a program writes, and small enough for the stack.
constexpr int kMaxDepth = 100;

using enum FormulaOperation;

constexpr std::pair<std::string_view, FormulaOperation> kComparisons[] = {
    {"<", kLess}, {"<=", kLessEqual}, {">", kGreater}, {">=", kGreaterEqual}, {"==", kEqual}, {"!=", kNotEqual},
};

std::optional<FormulaOperation> ComparisonOf(const FormulaToken& token) {
  if (token.kind != Kind::kOperator) return std::nullopt;
  for (const auto& [text, comparison] : kComparisons) {
    if (token.text == text) return comparison;
  }
  return std::nullopt;
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kMaxQuote = 40;
  if (text.size() <= kMaxQuote) return "'" + std::string(text) + "'";
  return "'" + std::string(text.substr(0, kMaxQuote)) + "...'";
}

// 'x' or 'y' where `name` is that letter and a number.
std::optional<char> IndexedVariable(std::string_view name) {
  if (name.size() < 2 || (name[0] != 'x' && name[0] != 'y')) return std::nullopt;
  const bool digits = name.find_first_not_of("0123456789", 1) == std::string_view::npos;
  return digits ? std::optional(name[0]) : std::nullopt;
}

const FormulaName* FunctionOf(std::string_view name) {
  const auto function = std::find_if(kFormulaFunctions.begin(), kFormulaFunctions.end(),
                                     [&](const FormulaName& f) { return f.name == name; });
  return function == kFormulaFunctions.end() ? nullptr : &*function;
}

bool IsWordOperator(std::string_view name) {
  return name == "and" || name == "or" || name == "if" || name == "else" || name == "not";
}

// Recursive descent, one function per rule of the grammar; each returns the step of its value. The first
// error wins: it turns the current token into the end, so that every loop stops by itself.
class Reader {
 public:
  Reader(std::string_view text, const FormulaVariables& variables) : text_(text), variables_(variables) {}

  absl::StatusOr<FormulaTree> Read() {
    if (text_.size() > kMaxTextSize) {
      return absl::InvalidArgumentError("the formula has " + std::to_string(text_.size()) +
                                        " bytes; at most 65536 are allowed");
    }
    Advance();
    if (token_.kind == Kind::kEnd && error_.empty()) Fail(0, "the formula is empty; write 0 for none");
    const int root = ReadComparison();
    if (token_.kind != Kind::kEnd) FailUnexpected(IsOperator(")") ? "')' closes nothing" : "");
    if (!error_.empty()) return absl::InvalidArgumentError(error_);
    return std::move(tree_).Take(root);
  }

 private:
  int ReadComparison() {
    int left = ReadSum();
    std::optional<int> chain;
    while (const std::optional<FormulaOperation> comparison = ComparisonOf(token_)) {
      Advance();
      const int right = ReadSum();
      const int holds = tree_.Operation(*comparison, left, right);
      chain = chain ? tree_.Operation(kMultiply, *chain, holds) : holds;
      left = right;
    }
    return chain.value_or(left);
  }

  int ReadSum() {
    int result = ReadProduct();
    while (IsOperator("+") || IsOperator("-")) {
      const FormulaOperation operation = token_.text == "+" ? kAdd : kSubtract;
      Advance();
      result = tree_.Operation(operation, result, ReadProduct());
    }
    return result;
  }

  int ReadProduct() {
    int result = ReadSigned();
    while (IsOperator("*") || IsOperator("/")) {
      const FormulaOperation operation = token_.text == "*" ? kMultiply : kDivide;
      Advance();
      result = tree_.Operation(operation, result, ReadSigned());
    }
    return result;
  }

  int ReadSigned() {
    bool negative = false;
    while (IsOperator("+") || IsOperator("-")) {
      negative ^= token_.text == "-";
      Advance();
    }
    const int power = ReadPower();
    return negative ? tree_.Operation(kNegate, power) : power;
  }

  int ReadPower() {
    const int base = ReadPrimary();
    if (!IsOperator("**") && !IsOperator("^")) return base;
    const std::size_t position = token_.position;
    Advance();
    return tree_.Operation(kPower, base, Nested(position, [this] { return ReadSigned(); }));
  }

  int ReadPrimary() {
    const FormulaToken token = token_;
    if (token.kind == Kind::kNumber) {
      Advance();
      return tree_.Number(token.value);
    }
    if (token.kind == Kind::kName) return ReadName();
    if (IsOperator("(")) {
      Advance();
      const int inner = Nested(token.position, [this] { return ReadComparison(); });
      Close(token.position);
      return inner;
    }
    constexpr std::string_view kExpected = "a number, a name or '(' is expected here";
    if (token.kind == Kind::kEnd) {
      return Fail(token.position, "the formula ends, but " + std::string(kExpected));
    }
    return Fail(token.position, "found " + Quoted(token.text) + ", but " + std::string(kExpected));
  }

  int ReadName() {
    const FormulaToken name = token_;
    const bool has_variables = variables_.states > 0 || variables_.constraints > 0;
    if (has_variables && IndexedVariable(name.text)) return ReadVariable(name);
    const FormulaName* function = FunctionOf(name.text);
    const auto parameter = variables_.parameters.find(name.text);
    const bool is_parameter = parameter != variables_.parameters.end();
    if (!function && !is_parameter && name.text != "t" && name.text != "pi" && name.text != "e") {
      return Fail(name.position,
                  "unknown name " + Quoted(name.text) + "; " + AdviceForUnknownName(name.text, variables_));
    }
    Advance();
    if (function) return ReadCall(*function, name);
    if (RefuseCall(name)) return tree_.Number(0);
    if (name.text == "t") return tree_.Time();
    if (name.text == "pi") return tree_.Number(std::numbers::pi);
    if (name.text == "e") return tree_.Number(std::numbers::e);
    return tree_.Number(parameter->second);
  }

  int ReadVariable(const FormulaToken& name) {
    const bool is_state = name.text[0] == 'x';
    const Index count = is_state ? variables_.states : variables_.constraints;
    const std::string what = is_state ? "states" : "constraints";
    Index number = 0;
    const char* end = name.text.data() + name.text.size();
    const bool in_range = std::from_chars(name.text.data() + 1, end, number).ec == std::errc();
    if (name.text[1] == '0') {
      return Fail(name.position, std::string(name.text) + ": " + what + " are counted from 1, without leading zeros");
    }
    if (!in_range || number > count) {
      return Fail(name.position, std::string(name.text) + ": there " + (count == 1 ? "is" : "are") + " only " +
                                     std::to_string(count) + " " +
                                     (count == 1 ? what.substr(0, what.size() - 1) : what));
    }
    Advance();
    if (RefuseCall(name)) return tree_.Number(0);
    return is_state ? tree_.State(number - 1) : tree_.Constraint(number - 1);
  }

  // Whether `name`, which was just read and is no function, is called like one.
  bool RefuseCall(const FormulaToken& name) {
    if (!IsOperator("(")) return false;
    Fail(token_.position, Quoted(name.text) + " is not a function; a product is written with *");
    return true;
  }

  int ReadCall(const FormulaName& function, const FormulaToken& name) {
    if (!IsOperator("(")) {
      return Fail(name.position, "the function " + Quoted(name.text) + " needs its argument in parentheses, " +
                                     std::string(name.text) + "(t)");
    }
    const std::size_t opened = token_.position;
    Advance();
    if (IsOperator(")")) Fail(token_.position, "the function " + Quoted(name.text) + " needs an argument");
    int result = Nested(opened, [this] { return ReadComparison(); });
    if (!function.takes_many) result = tree_.Operation(function.operation, result);
    while (IsOperator(",")) {
      if (!function.takes_many) {
        return Fail(token_.position, "the function " + Quoted(name.text) + " takes one argument");
      }
      Advance();
      result = tree_.Operation(function.operation, result, Nested(opened, [this] { return ReadComparison(); }));
    }
    Close(opened);
    return result;
  }

  template <typename Rule>
  int Nested(std::size_t position, Rule rule) {
    if (depth_ == kMaxDepth) {
      return Fail(position, "nested deeper than " + std::to_string(kMaxDepth) + " levels");
    }
    ++depth_;
    const int result = rule();
    --depth_;
    return result;
  }

  void Close(std::size_t opened) {
    if (IsOperator(")")) {
      Advance();
    } else if (token_.kind == Kind::kEnd) {
      Fail(opened, "this '(' is never closed");
    } else {
      FailUnexpected("");
    }
  }

  bool IsOperator(std::string_view text) const { return token_.kind == Kind::kOperator && token_.text == text; }

  void Advance() {
    if (!error_.empty()) return;
    token_ = NextFormulaToken(text_, token_.position + token_.text.size());
    if (token_.kind != Kind::kInvalid) return;
    Fail(token_.position, token_.text.empty() ? token_.advice : "found " + Quoted(token_.text) + "; " + token_.advice);
  }

  // The current token can not follow a complete operand.
  void FailUnexpected(std::string_view reason) {
    std::string message = "found " + Quoted(token_.text) + "; ";
    if (!reason.empty()) {
      message += reason;
    } else if (IsOperator(",")) {
      message += "a comma separates the arguments of min and max only, and a decimal point is a point";
    } else if (token_.kind == Kind::kName && IsWordOperator(token_.text)) {
      message += AdviceForUnknownName(token_.text, variables_);
    } else {
      message += "an operator is expected here, and a product is written with *, as in 2*t";
    }
    Fail(token_.position, message);
  }

  // Returns a valid step, so that the loops continue until they see the end of the text.
  int Fail(std::size_t position, const std::string& reason) {
    if (error_.empty()) error_ = "at position " + std::to_string(position + 1) + ": " + reason;
    token_ = {.kind = Kind::kEnd, .position = text_.size()};
    return tree_.Number(0);
  }

  const std::string_view text_;
  const FormulaVariables& variables_;
  FormulaToken token_;
  int depth_ = 0;
  FormulaTreeBuilder tree_;
  std::string error_;
};

}  // namespace

absl::StatusOr<FormulaTree> ReadFormula(std::string_view text, const FormulaVariables& variables) {
  return Reader(text, variables).Read();
}

std::string FaultOfParameterName(std::string_view name) {
  const FormulaToken token = NextFormulaToken(name, 0);
  if (token.kind != Kind::kName || token.text.size() != name.size()) {
    return "must be a letter or _, and then letters, digits and _";
  }
  if (name == "t") return "t is the time; must be another name";
  if (name == "pi" || name == "e") return std::string(name) + " is a number already; must be another name";
  if (FunctionOf(name)) return std::string(name) + " is a function; must be another name";
  if (IsWordOperator(name)) return std::string(name) + " is a word of Python; must be another name";
  if (IndexedVariable(name)) {
    return "x and y with a number are states and constraints; must be another name";
  }
  return {};
}

}  // namespace dlcs
