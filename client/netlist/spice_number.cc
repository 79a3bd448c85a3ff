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

// The factor of the suffix that `letters` (in small letters) begins with.
double SuffixFactor(std::string_view letters) {
  if (letters.starts_with("meg")) return 1e6;
  if (letters.starts_with("mil")) return 25.4e-6;
  if (letters.starts_with("\xc2\xb5") || letters.starts_with("\xce\xbc")) return 1e-6;
  static const std::map<char, double> kFactors = {{'t', 1e12}, {'g', 1e9},  {'k', 1e3},   {'m', 1e-3},
                                                  {'u', 1e-6}, {'n', 1e-9}, {'p', 1e-12}, {'f', 1e-15}};
  const auto found = letters.empty() ? kFactors.end() : kFactors.find(letters[0]);
  return found == kFactors.end() ? 1 : found->second;
}

// A power of ten as the divisor where it is below 1, so that 47u is the double nearest to 47e-6.
double Scaled(double mantissa, double factor) {
  if (factor >= 1 || factor == 25.4e-6) return mantissa * factor;
  return mantissa / std::round(1 / factor);
}

}  // namespace

bool IsSpiceLetter(char letter) { return std::isalpha(static_cast<unsigned char>(letter)) != 0 || letter == '_'; }

std::pair<double, std::size_t> LeadingSpiceNumber(std::string_view text) {
  const std::size_t length = NumberLength(text);
  if (length == 0) return {0, 0};
  double mantissa = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + length, mantissa);
  if (error != std::errc() || end != text.data() + length) return {0, 0};
  std::size_t letters = length;
  while (const std::size_t letter = UnitLetterLength(text.substr(letters))) letters += letter;
  if (letters < text.size() && static_cast<unsigned char>(text[letters]) >= 0x80) return {0, 0};
  if (letters < text.size() && IsSpiceDigit(text[letters]) && letters > length) return {0, 0};  // 4k7
  const std::string suffix = Lower(text.substr(length, letters - length));
  return {Scaled(mantissa, SuffixFactor(suffix)), letters};
}

std::optional<double> ReadSpiceNumber(std::string_view text) {
  double sign = 1;
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) {
    sign = text[0] == '-' ? -1 : 1;
    text.remove_prefix(1);
  }
  const auto [value, length] = LeadingSpiceNumber(text);
  if (length == 0 || length != text.size() || !std::isfinite(value)) return std::nullopt;
  return sign * value;
}

}  // namespace dlcs::client
