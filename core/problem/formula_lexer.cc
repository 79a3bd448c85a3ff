// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_lexer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "absl/strings/numbers.h"

namespace dlcs {
namespace {

using Kind = FormulaToken::Kind;

// The functions of <cctype> depend on the locale; these do not.
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
char Lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

struct Hint {
  std::string_view found;
  std::string_view advice;
};

constexpr std::string_view kAdviceAnd = "write a product of comparisons, (0 < t)*(t < 1), or the chain 0 < t < 1";
constexpr std::string_view kAdviceOr = "write max(a, b) of two comparisons";
constexpr std::string_view kAdviceNot = "write a == 0 for 'not a'";
constexpr std::string_view kAdviceIf = "write a sum of products with comparisons, (t < 1)*a + (t >= 1)*b";
constexpr std::string_view kAdvicePrefix = "write functions without a prefix, sin(t)";
constexpr std::string_view kAdviceFinite = "a formula must have a finite value; write a number";

// Operators of other languages, longer ones first.
constexpr std::array kForeignOperators = {
    Hint{"//", "write floor(a/b)"},
    Hint{"&&", kAdviceAnd},
    Hint{"||", kAdviceOr},
    Hint{"%", "write a - b*floor(a/b)"},
    Hint{"=", "a formula is one value and assigns nothing; write == to compare"},
    Hint{";", "a formula is one value; write a list of formulas for several components"},
    Hint{"&", kAdviceAnd},
    Hint{"|", kAdviceOr},
    Hint{"!", kAdviceNot},
    Hint{"~", kAdviceNot},
    Hint{"?", kAdviceIf},
    Hint{":", kAdviceIf},
    Hint{"[", "write parentheses"},
    Hint{"]", "write parentheses"},
    Hint{"{", "write parentheses"},
    Hint{"}", "write parentheses"},
    Hint{"\"", "there are no strings"},
    Hint{"'", "there are no strings"},
    Hint{".", "a point belongs to a number, as in 0.5, and names have no prefix"},
};

constexpr std::array kForeignNames = {
    Hint{"and", kAdviceAnd},
    Hint{"or", kAdviceOr},
    Hint{"not", kAdviceNot},
    Hint{"if", kAdviceIf},
    Hint{"else", kAdviceIf},
    Hint{"heaviside", "write the comparison (t >= 0)"},
    Hint{"ln", "write log, the natural logarithm"},
    Hint{"log2", "write log(t)/log(2)"},
    Hint{"pow", "write a**b"},
    Hint{"power", "write a**b"},
    Hint{"fabs", "write abs"},
    Hint{"arcsin", "write asin"},
    Hint{"arccos", "write acos"},
    Hint{"arctan", "write atan"},
    Hint{"np", kAdvicePrefix},
    Hint{"numpy", kAdvicePrefix},
    Hint{"math", kAdvicePrefix},
    Hint{"true", "write 1"},
    Hint{"false", "write 0"},
    Hint{"inf", kAdviceFinite},
    Hint{"nan", kAdviceFinite},
};

// Characters that text processors substitute for those of a formula.
struct Lookalike {
  std::uint32_t code_point;
  std::string_view advice;
};
constexpr std::array kLookalikes = {
    Lookalike{0x00A0, "write a plain space"},
    Lookalike{0x00B2, "write **2"},
    Lookalike{0x00B3, "write **3"},
    Lookalike{0x00B7, "write *"},
    Lookalike{0x00D7, "write *"},
    Lookalike{0x00F7, "write /"},
    Lookalike{0x03C0, "write pi"},
    Lookalike{0x2009, "write a plain space"},
    Lookalike{0x2010, "write the plain minus -"},
    Lookalike{0x2011, "write the plain minus -"},
    Lookalike{0x2012, "write the plain minus -"},
    Lookalike{0x2013, "write the plain minus -"},
    Lookalike{0x2014, "write the plain minus -"},
    Lookalike{0x202F, "write a plain space"},
    Lookalike{0x2212, "write the plain minus -"},
    Lookalike{0x2215, "write /"},
    Lookalike{0x2217, "write *"},
    Lookalike{0x221A, "write sqrt(...)"},
    Lookalike{0x22C5, "write *"},
    Lookalike{0x2260, "write !="},
    Lookalike{0x2264, "write <="},
    Lookalike{0x2265, "write >="},
    Lookalike{0xFEFF, "remove the byte order mark"},
};

FormulaToken Invalid(std::string_view text, std::size_t position, std::size_t size, std::string advice) {
  return {
      .kind = Kind::kInvalid, .text = text.substr(position, size), .position = position, .advice = std::move(advice)};
}

// Length in bytes of the UTF-8 sequence at `begin`, 0 when it is none; its code point in `code_point`.
std::size_t DecodeUtf8(std::string_view text, std::size_t begin, std::uint32_t& code_point) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(begin);
  const std::size_t size = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || begin + size > text.size()) return 0;
  code_point = lead & (0x7F >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(begin + i) & 0xC0) != 0x80) return 0;
    code_point = code_point << 6 | (byte(begin + i) & 0x3F);
  }
  const bool overlong = (size == 3 && code_point < 0x800) || (size == 4 && code_point < 0x10000);
  const bool surrogate = code_point >= 0xD800 && code_point < 0xE000;
  return overlong || surrogate || code_point > 0x10FFFF ? 0 : size;
}

std::string Hexadecimal(const char* format, unsigned value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

// Control characters and everything beyond ASCII. The text of the token is kept only where it is sound UTF-8,
// so that messages are.
FormulaToken ReadStrangeCharacter(std::string_view text, std::size_t begin) {
  const unsigned char byte = static_cast<unsigned char>(text[begin]);
  if (byte < 0x80) {
    return Invalid(text, begin, 0, Hexadecimal("the control character 0x%02X is not allowed", byte));
  }
  std::uint32_t code_point = 0;
  const std::size_t size = DecodeUtf8(text, begin, code_point);
  if (size == 0) return Invalid(text, begin, 0, Hexadecimal("the byte 0x%02X is neither ASCII nor UTF-8", byte));
  std::string advice = Hexadecimal("this is U+%04X, and formulas are plain ASCII", code_point);
  for (const Lookalike& lookalike : kLookalikes) {
    if (lookalike.code_point == code_point) advice.append("; ").append(lookalike.advice);
  }
  return Invalid(text, begin, size, std::move(advice));
}

std::size_t SkipDigits(std::string_view text, std::size_t i) {
  while (i < text.size() && IsDigit(text[i])) ++i;
  return i;
}

FormulaToken ReadNumber(std::string_view text, std::size_t begin) {
  const auto at = [&](std::size_t i) { return i < text.size() ? text[i] : '\0'; };
  std::size_t end = SkipDigits(text, begin);
  const bool leading_zero = end - begin > 1 && text[begin] == '0' &&
                            text.substr(begin, end - begin).find_first_not_of('0') != std::string_view::npos;
  bool whole = true;
  if (at(end) == '.') {
    whole = false;
    end = SkipDigits(text, end + 1);
  }
  if (Lower(at(end)) == 'e') {
    const std::size_t digits = end + (at(end + 1) == '+' || at(end + 1) == '-' ? 2 : 1);
    if (!IsDigit(at(digits))) {
      return Invalid(text, begin, digits - begin,
                     "an exponent needs digits, as in 1e-6; a product with e is written 2*e");
    }
    whole = false;
    end = SkipDigits(text, digits);
  }
  const auto invalid = [&](std::string advice) {
    while (IsDigit(at(end)) || IsLetter(at(end)) || at(end) == '.') ++end;
    return Invalid(text, begin, std::min<std::size_t>(end - begin, 40), std::move(advice));
  };
  if (at(end) == '.') return invalid("a number has one decimal point");
  if (at(end) == '_') return invalid("digits are not grouped; write 1000 for 1_000");
  if (Lower(at(end)) == 'j') return invalid("numbers are real");
  if (end - begin == 1 && text[begin] == '0' &&
      (Lower(at(end)) == 'x' || Lower(at(end)) == 'b' || Lower(at(end)) == 'o')) {
    return invalid("numbers are decimal");
  }
  if (whole && leading_zero) return invalid("a whole number does not begin with 0");

  FormulaToken token{.kind = Kind::kNumber, .text = text.substr(begin, end - begin), .position = begin};
  // Abseil's conversion is correctly rounded, does not depend on the locale, and returns 0 or infinity outside the
  // range of a double.
  if (!absl::SimpleAtod({token.text.data(), token.text.size()}, &token.value) || !std::isfinite(token.value)) {
    return invalid("this number is beyond the range of a double, 1.8e308");
  }
  return token;
}

// Counts the letters to replace, insert, remove, or exchange with their neighbor. Case is ignored.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  const auto same = [&](std::size_t i, std::size_t j) { return Lower(a[i - 1]) == Lower(b[j - 1]); };
  std::vector<std::vector<std::size_t>> distance(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      std::size_t& best = distance[i][j];
      if (i == 0 || j == 0) {
        best = i + j;
        continue;
      }
      best = std::min({distance[i - 1][j] + 1, distance[i][j - 1] + 1, distance[i - 1][j - 1] + !same(i, j)});
      if (i > 1 && j > 1 && same(i, j - 1) && same(i - 1, j)) best = std::min(best, distance[i - 2][j - 2] + 1);
    }
  }
  return distance[a.size()][b.size()];
}

}  // namespace

FormulaToken NextFormulaToken(std::string_view text, std::size_t begin) {
  while (begin < text.size() && IsSpace(text[begin])) ++begin;
  if (begin >= text.size()) return {.kind = Kind::kEnd, .position = text.size()};
  const char c = text[begin];
  const std::string_view rest = text.substr(begin);
  if (IsDigit(c) || (c == '.' && rest.size() > 1 && IsDigit(rest[1]))) return ReadNumber(text, begin);
  if (IsLetter(c)) {
    std::size_t size = 1;
    while (size < rest.size() && (IsLetter(rest[size]) || IsDigit(rest[size]))) ++size;
    return {.kind = Kind::kName, .text = rest.substr(0, size), .position = begin};
  }
  for (std::string_view op : {"**", "<=", ">=", "==", "!="}) {
    if (rest.starts_with(op)) return {.kind = Kind::kOperator, .text = rest.substr(0, 2), .position = begin};
  }
  for (const Hint& foreign : kForeignOperators) {
    if (rest.starts_with(foreign.found)) {
      return Invalid(text, begin, foreign.found.size(), std::string(foreign.advice));
    }
  }
  if (std::string_view("+-*/^<>(),").find(c) != std::string_view::npos) {
    return {.kind = Kind::kOperator, .text = rest.substr(0, 1), .position = begin};
  }
  if (c > ' ' && c < 0x7F) return Invalid(text, begin, 1, "no formula contains this character");
  return ReadStrangeCharacter(text, begin);
}

std::string AdviceForUnknownName(std::string_view name, const FormulaVariables& variables) {
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(), Lower);
  for (const Hint& foreign : kForeignNames) {
    if (foreign.found == lower) return std::string(foreign.advice);
  }
  const auto components = [](char letter, Index count) {
    if (count == 0) return std::string();
    const std::string first = std::string(" ") + letter + "1";
    if (count == 1) return first;
    return first + (count > 2 ? " ... " : " ") + letter + std::to_string(count);
  };
  const std::string x_and_y = components('x', variables.states) + components('y', variables.constraints);
  const auto is_letter_of = [&lower](std::string_view letters) {
    return letters.find(lower.front()) != std::string_view::npos &&
           std::all_of(lower.begin() + 1, lower.end(), IsDigit);
  };
  // A w without a number may be an angular frequency.
  if (is_letter_of("xy") || (lower.size() > 1 && is_letter_of("w"))) {
    return x_and_y.empty()
               ? "formulas in states and constraints need \"kind\": \"nonlinear\"; in a linear problem f and g "
                 "depend on t alone"
               : "components are" + x_and_y;
  }
  // A name is near if at most a third of its characters are wrong; T is near t, but x is not.
  std::size_t best = name.size() / 3 + 1;
  std::string_view nearest;
  const auto consider = [&](std::string_view candidate) {
    const std::size_t distance = name.size() < 20 ? EditDistance(name, candidate) : best;
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  };
  std::string all = "the names are t" + x_and_y + " pi e";
  for (std::string_view constant : {"t", "pi", "e"}) consider(constant);
  for (const auto& [parameter, value] : variables.parameters) {
    consider(parameter);
    all += " " + parameter;
  }
  for (const FormulaName& function : kFormulaFunctions) {
    consider(function.name);
    all.append(" ").append(function.name);
  }
  all += "; numbers of your own go into \"parameters\"";
  return nearest.empty() ? all : "did you mean '" + std::string(nearest) + "'?";
}

}  // namespace dlcs
