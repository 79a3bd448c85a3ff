// SPDX-License-Identifier: Apache-2.0
#include "core/formula_syntax.h"

#include <algorithm>
#include <charconv>
#include <numbers>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "core/formula_lexer.h"
#include "core/number_text.h"

namespace dlcs {
namespace {

using Kind = FormulaToken::Kind;

constexpr std::size_t kMaxTextSize = 64 * 1024;
// Deep enough for any formula that a person or a program writes down, shallow for the stack.
constexpr int kMaxDepth = 100;
// muParser refuses a text of 20,000 characters or more.
constexpr std::size_t kMaxMuparserTextSize = 19'999;

constexpr std::pair<std::string_view, Comparison> kComparisons[] = {
    {"<", Comparison::kLess},          {"<=", Comparison::kLessEqual}, {">", Comparison::kGreater},
    {">=", Comparison::kGreaterEqual}, {"==", Comparison::kEqual},     {"!=", Comparison::kNotEqual},
};

std::optional<Comparison> ComparisonOf(const FormulaToken& token) {
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

// Recursive descent, one function per rule of the grammar; each returns the text for muParser. The first
// error wins: it turns the current token into the end, so that every loop stops by itself.
class Reader {
 public:
  Reader(std::string_view text, FormulaVariables variables) : text_(text), variables_(variables) {}

  absl::StatusOr<FormulaSyntax> Read() {
    if (text_.size() > kMaxTextSize) {
      return absl::InvalidArgumentError("the formula has " + std::to_string(text_.size()) +
                                        " bytes; at most 65536 are read");
    }
    Advance();
    if (token_.kind == Kind::kEnd && error_.empty()) Fail(0, "the formula is empty; write 0 for none");
    syntax_.muparser_text = ReadComparison();
    if (token_.kind != Kind::kEnd) FailUnexpected(IsOperator(")") ? "')' closes nothing" : "");
    if (error_.empty() && syntax_.muparser_text.size() > kMaxMuparserTextSize) {
      Fail(0, "the formula is too long: " + std::to_string(syntax_.muparser_text.size()) +
                  " characters without its blanks; at most " + std::to_string(kMaxMuparserTextSize) +
                  " are allowed");
    }
    if (!error_.empty()) return absl::InvalidArgumentError(error_);
    return std::move(syntax_);
  }

 private:
  std::string ReadComparison() {
    std::string left = ReadSum();
    std::string op;
    std::string right;
    std::string chain;  // operators and operands after `left`, as arguments
    int links = 0;
    while (const std::optional<Comparison> comparison = ComparisonOf(token_)) {
      op = token_.text;
      Advance();
      right = ReadSum();
      chain += "," + std::to_string(static_cast<int>(*comparison)) + "," + right;
      ++links;
    }
    if (links == 0) return left;
    if (links == 1) return left + op + right;  // muParser's own comparisons are faster than a call
    Use(kChainFunction);
    return std::string(kChainFunction) + "(" + left + chain + ")";
  }

  std::string ReadSum() {
    std::string result = ReadProduct();
    while (IsOperator("+") || IsOperator("-")) {
      result += token_.text;
      Advance();
      result += ReadProduct();
    }
    return result;
  }

  std::string ReadProduct() {
    std::string result = ReadSigned();
    while (IsOperator("*") || IsOperator("/")) {
      result += token_.text;
      Advance();
      result += ReadSigned();
    }
    return result;
  }

  std::string ReadSigned() {
    bool negative = false;
    while (IsOperator("+") || IsOperator("-")) {
      negative ^= token_.text == "-";
      Advance();
    }
    std::string power = ReadPower();
    return negative ? "(-" + power + ")" : power;
  }

  std::string ReadPower() {
    std::string base = ReadPrimary();
    if (!IsOperator("**") && !IsOperator("^")) return base;
    const std::size_t position = token_.position;
    Advance();
    return base + "^(" + Nested(position, [this] { return ReadSigned(); }) + ")";
  }

  std::string ReadPrimary() {
    const FormulaToken token = token_;
    if (token.kind == Kind::kNumber) {
      Advance();
      return NumberText(token.value);
    }
    if (token.kind == Kind::kName) return ReadName();
    if (IsOperator("(")) {
      Advance();
      std::string inner = Nested(token.position, [this] { return ReadComparison(); });
      Close(token.position);
      return "(" + inner + ")";
    }
    constexpr std::string_view kExpected = "a number, a name or '(' is expected here";
    if (token.kind == Kind::kEnd) {
      Fail(token.position, "the formula ends, but " + std::string(kExpected));
    } else {
      Fail(token.position, "found " + Quoted(token.text) + ", but " + std::string(kExpected));
    }
    return {};
  }

  std::string ReadName() {
    const FormulaToken name = token_;
    const auto function = std::find_if(kFormulaFunctions.begin(), kFormulaFunctions.end(),
                                       [&](const FormulaName& f) { return f.name == name.text; });
    const bool is_function = function != kFormulaFunctions.end();
    if (const std::optional<char> kind = IndexedVariable(name.text)) return ReadVariable(*kind, name);
    if (!is_function && name.text != "t" && name.text != "pi" && name.text != "e") {
      Fail(name.position, "unknown name " + Quoted(name.text) + "; " + AdviceForUnknownName(name.text, variables_));
      return {};
    }
    Advance();
    if (is_function) return ReadCall(*function, name);
    if (RefuseCall(name)) return {};
    if (name.text == "pi") return NumberText(std::numbers::pi);
    if (name.text == "e") return NumberText(std::numbers::e);
    syntax_.depends_on_t = true;
    return "t";
  }

  // 'x' or 'y' where `name` is that letter and a number, and there are variables besides t.
  std::optional<char> IndexedVariable(std::string_view name) const {
    if (variables_.states == 0 && variables_.constraints == 0) return std::nullopt;
    if (name.size() < 2 || (name[0] != 'x' && name[0] != 'y')) return std::nullopt;
    const bool digits = name.find_first_not_of("0123456789", 1) == std::string_view::npos;
    return digits ? std::optional(name[0]) : std::nullopt;
  }

  std::string ReadVariable(char kind, const FormulaToken& name) {
    const bool is_state = kind == 'x';
    const Index count = is_state ? variables_.states : variables_.constraints;
    const std::string what = is_state ? "states" : "constraints";
    Index number = 0;
    const char* end = name.text.data() + name.text.size();
    const bool in_range = std::from_chars(name.text.data() + 1, end, number).ec == std::errc();
    if (name.text[1] == '0') {
      Fail(name.position, std::string(name.text) + ": " + what + " are counted from 1, without leading zeros");
      return {};
    }
    if (!in_range || number > count) {
      Fail(name.position, std::string(name.text) + ": there " + (count == 1 ? "is" : "are") + " only " +
                              std::to_string(count) + " " + (count == 1 ? what.substr(0, what.size() - 1) : what));
      return {};
    }
    std::vector<Index>& used = is_state ? syntax_.states : syntax_.constraints;
    if (std::find(used.begin(), used.end(), number - 1) == used.end()) used.push_back(number - 1);
    Advance();
    if (RefuseCall(name)) return {};
    return std::string(name.text);
  }

  // Whether `name`, which was just read and is no function, is called like one.
  bool RefuseCall(const FormulaToken& name) {
    if (!IsOperator("(")) return false;
    Fail(token_.position, Quoted(name.text) + " is not a function; a product is written with *");
    return true;
  }

  std::string ReadCall(const FormulaName& function, const FormulaToken& name) {
    if (!IsOperator("(")) {
      Fail(name.position, "the function " + Quoted(name.text) + " needs its argument in parentheses, " +
                              std::string(name.text) + "(t)");
      return {};
    }
    const std::size_t opened = token_.position;
    Advance();
    if (IsOperator(")")) Fail(token_.position, "the function " + Quoted(name.text) + " needs an argument");
    Use(function.name);
    std::string result(name.text);
    result += "(" + Nested(opened, [this] { return ReadComparison(); });
    while (IsOperator(",")) {
      if (!function.takes_many) {
        Fail(token_.position, "the function " + Quoted(name.text) + " takes one argument");
        break;
      }
      Advance();
      result += "," + Nested(opened, [this] { return ReadComparison(); });
    }
    Close(opened);
    return result + ")";
  }

  void Use(std::string_view function) {
    std::vector<std::string_view>& used = syntax_.functions;
    if (std::find(used.begin(), used.end(), function) == used.end()) used.push_back(function);
  }

  template <typename Rule>
  std::string Nested(std::size_t position, Rule rule) {
    if (depth_ == kMaxDepth) {
      Fail(position, "nested deeper than " + std::to_string(kMaxDepth) + " levels");
      return {};
    }
    ++depth_;
    std::string result = rule();
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

  bool IsOperator(std::string_view text) const {
    return token_.kind == Kind::kOperator && token_.text == text;
  }

  void Advance() {
    if (!error_.empty()) return;
    token_ = NextFormulaToken(text_, token_.position + token_.text.size());
    if (token_.kind != Kind::kInvalid) return;
    Fail(token_.position,
         token_.text.empty() ? token_.advice : "found " + Quoted(token_.text) + "; " + token_.advice);
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

  static bool IsWordOperator(std::string_view name) {
    return name == "and" || name == "or" || name == "if" || name == "else" || name == "not";
  }

  void Fail(std::size_t position, const std::string& reason) {
    if (error_.empty()) error_ = "at position " + std::to_string(position + 1) + ": " + reason;
    token_ = {.kind = Kind::kEnd, .position = text_.size()};
  }

  const std::string_view text_;
  const FormulaVariables variables_;
  FormulaToken token_;
  int depth_ = 0;
  FormulaSyntax syntax_;
  std::string error_;
};

}  // namespace

absl::StatusOr<FormulaSyntax> ReadFormula(std::string_view text, FormulaVariables variables) {
  return Reader(text, variables).Read();
}

}  // namespace dlcs
