// SPDX-License-Identifier: Apache-2.0
#include "core/formula_syntax.h"

#include <algorithm>
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
  explicit Reader(std::string_view text) : text_(text) {}

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
    if (!is_function && name.text != "t" && name.text != "pi" && name.text != "e") {
      Fail(name.position, "unknown name " + Quoted(name.text) + "; " + AdviceForUnknownName(name.text));
      return {};
    }
    Advance();
    if (is_function) return ReadCall(*function, name);
    if (IsOperator("(")) {
      Fail(token_.position, Quoted(name.text) + " is not a function; a product is written with *");
      return {};
    }
    if (name.text == "pi") return NumberText(std::numbers::pi);
    if (name.text == "e") return NumberText(std::numbers::e);
    syntax_.depends_on_t = true;
    return "t";
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
      message += AdviceForUnknownName(token_.text);
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
  FormulaToken token_;
  int depth_ = 0;
  FormulaSyntax syntax_;
  std::string error_;
};

}  // namespace

absl::StatusOr<FormulaSyntax> ReadFormula(std::string_view text) { return Reader(text).Read(); }

}  // namespace dlcs
