// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/spice_number.h"

#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <string>
#include <system_error>

#include "client/netlist/deck_lines.h"

namespace dlcs::client {
namespace {

// The length of the number that `text` begins with, without suffix; 0 if it begins with none.
std::size_t NumberLength(std::string_view text) {
  std::size_t at = 0, digits = 0;
  const auto skip_digits = [&] {
    while (at < text.size() && IsSpiceDigit(text[at])) ++at, ++digits;
  };
  skip_digits();
  if (at < text.size() && text[at] == '.') {
    ++at;
    skip_digits();
  }
  if (digits == 0) return 0;
  if (at < text.size() && (text[at] == 'e' || text[at] == 'E')) {
    std::size_t exponent = at + 1;
    if (exponent < text.size() && (text[exponent] == '+' || text[exponent] == '-')) ++exponent;
    if (exponent < text.size() && IsSpiceDigit(text[exponent])) {
      while (exponent < text.size() && IsSpiceDigit(text[exponent])) ++exponent;
      at = exponent;
    }
  }
  return at;
}

// The length of the letter of a suffix or unit that `text` begins with: of ASCII, µ (two signs look like it) or Ω (two
// as well); 0 for any other. Others are most often what is left of µ after a change of the encoding, as in Âµ, and
// must not pass for a unit.
std::size_t UnitLetterLength(std::string_view text) {
  if (text.empty()) return 0;
  if (IsSpiceLetter(text[0])) return 1;
  for (const std::string_view letter : {"\xc2\xb5", "\xce\xbc", "\xce\xa9", "\xe2\x84\xa6"}) {
    if (text.starts_with(letter)) return letter.size();
  }
  return 0;
}

// The suffix that `letters` begins with: its length, and the power of ten for which it stands.
struct Suffix {
  std::size_t length = 0;
  int exponent = 0;
  bool is_mil = false;  // a thousandth of an inch
};

Suffix SuffixOf(std::string_view letters) {
  const std::string lower = Lower(letters.substr(0, 3));
  if (lower == "meg") return {3, 6};
  if (lower == "mil") return {3, 0, true};
  if (lower.starts_with("\xc2\xb5") || lower.starts_with("\xce\xbc")) return {2, -6};
  static const std::map<char, int> kExponents = {{'t', 12}, {'g', 9},  {'k', 3},   {'m', -3},
                                                 {'u', -6}, {'n', -9}, {'p', -12}, {'f', -15}};
  const auto found = lower.empty() ? kExponents.end() : kExponents.find(lower[0]);
  return found == kExponents.end() ? Suffix() : Suffix{1, found->second};
}

// The double nearest to `number`, in decimal digits, times the suffix: 0.1u is that of 0.1e-6. Absent where it is too
// large or too small for one.
std::optional<double> Scaled(std::string_view number, const Suffix& suffix) {
  std::string text(number);
  if (suffix.exponent != 0) {
    const std::size_t e = number.find_first_of("eE");
    int exponent = 0;
    if (e != std::string_view::npos) {
      const char* const begin = number.data() + e + (number[e + 1] == '+' ? 2 : 1);
      const char* const end = number.data() + number.size();
      // Beyond five digits there is no number that is in range without them.
      if (end - begin > 6 || std::from_chars(begin, end, exponent).ptr != end) return std::nullopt;
    }
    text = std::string(number.substr(0, e)) + "e" + std::to_string(exponent + suffix.exponent);
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return suffix.is_mil ? 25.4e-6 * value : value;
}

// `text` without its sign, and 1 or -1.
double TakeSign(std::string_view& text) {
  if (text.empty() || (text[0] != '-' && text[0] != '+')) return 1;
  const double sign = text[0] == '-' ? -1 : 1;
  text.remove_prefix(1);
  return sign;
}

}  // namespace

bool IsSpiceLetter(char letter) { return std::isalpha(static_cast<unsigned char>(letter)) != 0 || letter == '_'; }

std::pair<double, std::size_t> LeadingSpiceNumber(std::string_view text) {
  const std::size_t length = NumberLength(text);
  if (length == 0) return {0, 0};
  std::size_t letters = length;
  while (const std::size_t letter = UnitLetterLength(text.substr(letters))) letters += letter;
  if (letters < text.size() && static_cast<unsigned char>(text[letters]) >= 0x80) return {0, 0};
  if (letters < text.size() && IsSpiceDigit(text[letters]) && letters > length) return {0, 0};  // 4k7
  const std::optional<double> value = Scaled(text.substr(0, length), SuffixOf(text.substr(length, letters - length)));
  return value ? std::pair(*value, letters) : std::pair(0.0, std::size_t{0});
}

std::optional<double> ReadSpiceNumber(std::string_view text) {
  const double sign = TakeSign(text);
  const auto [value, length] = LeadingSpiceNumber(text);
  if (length == 0 || length != text.size() || !std::isfinite(value)) return std::nullopt;
  return sign * value;
}

std::optional<double> ReadNumberWithSuffix(std::string_view text) {
  const double sign = TakeSign(text);
  const std::size_t length = NumberLength(text);
  if (length == 0) return std::nullopt;
  const Suffix suffix = SuffixOf(text.substr(length));
  if (length + suffix.length != text.size() || suffix.is_mil || text.substr(length) == "M") return std::nullopt;
  const std::optional<double> value = Scaled(text.substr(0, length), suffix);
  if (!value || !std::isfinite(*value)) return std::nullopt;
  return sign * *value;
}

}  // namespace dlcs::client
