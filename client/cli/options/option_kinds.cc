// SPDX-License-Identifier: Apache-2.0
#include "client/cli/options/option_kinds.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "client/files/json_text.h"
#include "client/netlist/deck_words.h"
#include "client/netlist/spice_number.h"

namespace dlcs::client {
namespace {

std::optional<double> ParseNumber(const std::string& text) {
  double value = 0;
  const char* begin = text.c_str() + (text.size() > 1 && text[0] == '+' ? 1 : 0);
  const char* end = text.c_str() + text.size();
  const auto [rest, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

// What to write instead, where letters follow a number that are no suffix.
std::string SuffixHint(const std::string& text) {
  if (!ReadSpiceNumber(text)) return "";
  const std::size_t letters = text.find_last_of("0123456789.") + 1;
  if (text.substr(letters) == "M") {
    return fmt::format("; M is milli in SPICE and mega elsewhere: write {0}m or {0}meg", text.substr(0, letters));
  }
  for (std::size_t end = text.size(); end > letters; --end) {
    const std::string shorter = text.substr(0, end - 1);
    const bool is_more = end - 1 > letters || text.substr(letters) == "s";  // 1x is no number with a unit
    if (is_more && ReadNumberWithSuffix(shorter)) return fmt::format("; write {}, without a unit", shorter);
  }
  return "; suffixes are t, g, meg, k, m, u, n, p and f, as in 20u";
}

// A number above 0 with one of `units`, which `words` lists; the first is none.
double ParseWithUnit(const std::string& text, std::span<const std::pair<const char*, double>> units, const char* words,
                     const std::string& option) {
  const std::string above = fmt::format("above 0, {}", words);
  NumberRule rule = Positive();
  rule.words = above.c_str();
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0; };
  const auto letters = std::find_if_not(text.rbegin(), text.rend(), is_letter).base();
  const std::string number(text.begin(), letters), unit(letters, text.end());
  if (number.empty()) return CheckedNumber(text, rule, option);
  for (const auto& [name, size] : units) {
    if (absl::EqualsIgnoreCase(unit, name)) return size * CheckedNumber(number, rule, option);
  }
  throw CLI::ValidationError(option, fmt::format("\"{}\" has an unknown unit, {}; must be {}", text, unit, words));
}

}  // namespace

double CheckedNumber(const std::string& text, const NumberRule& rule, const std::string& option) {
  const bool takes_suffixes = !rule.whole && !rule.of_clock;
  auto value = ParseNumber(text);
  if (!value && takes_suffixes) value = ReadNumberWithSuffix(text);
  if (!value || !rule.Holds(*value)) {
    if (rule.whole && value && *value != std::floor(*value)) {
      throw CLI::ValidationError(option, fmt::format("\"{}\" is not a whole number", text));
    }
    // The engine's rules begin with the bounds.
    const char* const article = std::string_view(rule.words).starts_with("at least") ? "a number of " : "";
    const std::string hint = !value && takes_suffixes ? SuffixHint(text) : "";
    throw CLI::ValidationError(option, fmt::format("\"{}\" is not {}{}{}", text, article, rule.words, hint));
  }
  return *value;
}

namespace {

// A time, or the times of a range begin:step:end; it includes `end` if that is a whole number of steps away.
void AddTimes(const std::string& entry, const NumberRule& rule, const std::string& option, std::vector<double>& times) {
  constexpr double kMaxTimes = 1e7;
  const std::size_t first = entry.find(':');
  if (first == std::string::npos) return times.push_back(CheckedNumber(entry, rule, option));
  const std::size_t second = std::min(entry.find(':', first + 1), entry.size());
  const double begin = CheckedNumber(entry.substr(0, first), rule, option);
  const double step = CheckedNumber(entry.substr(first + 1, second - first - 1),
                                    {"the step of a range begin:step:end, a number above 0", Positive().least}, option);
  const double end = CheckedNumber(second < entry.size() ? entry.substr(second + 1) : "",
                                   {"the end of a range begin:step:end", rule.least}, option);
  const double steps = (end - begin) / step;
  if (!(steps >= 0 && steps <= kMaxTimes)) {
    static constexpr char kRule[] =
        "\"{}\" is not a range begin:step:end whose end is after its beginning, with at most {} steps";
    throw CLI::ValidationError(option, fmt::format(kRule, entry, kMaxTimes));
  }
  if (steps > 0 && steps < 1 - 1e-9) {
    // Most likely begin:end:step, as other programs write it; it would be one time.
    static constexpr char kRule[] =
        "\"{0}\" has a step of {1:g} from {2:g} to {3:g}; ranges are begin:step:end, as in {2:g}:{3:g}:{1:g}";
    throw CLI::ValidationError(option, fmt::format(kRule, entry, step, begin, end));
  }
  const double nearest = std::round(steps);
  const bool meets_end = std::abs(steps - nearest) <= 1e-9 * std::max(1.0, nearest);
  const double last = meets_end ? nearest : std::floor(steps);
  for (double k = 0; k <= last; ++k)
    times.push_back(meets_end && last > 0 ? (begin * (last - k) + end * k) / last : begin + k * step);
  if (meets_end) times.back() = end;  // to the last bit: it may be T
}

}  // namespace

std::vector<double> ParseTimes(const std::string& text, const std::string& option) {
  const NumberRule rule = Within("a time: a number of at least 0", 0, std::numeric_limits<double>::infinity());
  std::vector<double> times;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    std::string entry = text.substr(begin, end - begin);
    entry.erase(0, entry.find_first_not_of(' '));
    AddTimes(entry, rule, option, times);
    begin = end + 1;
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

namespace {

// Numbers and ranges of them, right or wrong as times: nothing that would be the name of a file.
bool IsListOfNumbers(const std::string& text) {
  const bool has_digits = text.find_first_of("0123456789") != std::string::npos;
  if (has_digits && text.find_first_not_of("0123456789.,+-eE ") == std::string::npos) return true;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find_first_of(",:", begin), text.size());
    if (!ReadNumberWithSuffix(Trimmed(text.substr(begin, end - begin)))) return false;
    begin = end + 1;
  }
  return true;
}

}  // namespace

std::vector<double> ParseTimesOrFile(const std::string& text, const std::string& option) {
  if (text.empty()) throw CLI::ValidationError(option, "is empty; is a variable of your script unset?");
  if (IsListOfNumbers(text)) return ParseTimes(text, option);
  const auto content = ReadTextFile(text);
  if (!content.ok() && text.find(',') != std::string::npos) {
    // Probably meant as a list: the error then names the wrong entry.
    return ParseTimes(text, option);
  }
  if (!content.ok()) {
    throw CLI::ValidationError(option, fmt::format("{}; write times, as in 0.1,0.5, or the name of a file with them",
                                                   std::string(content.status().message())));
  }
  std::string list;
  for (const char c : *content) {
    const bool between = c == ',' || std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!between)
      list += c;
    else if (!list.empty() && list.back() != ',')
      list += ',';
  }
  if (!list.empty() && list.back() == ',') list.pop_back();
  return ParseTimes(list, option + " " + text);
}

double ParseBytes(const std::string& text, const std::string& option) {
  constexpr std::pair<const char*, double> kUnits[] = {{"", 1}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"TB", 1e12}};
  constexpr double kAny = 0x1p62;  // as good as no limit, and a number of 64 bits
  return std::min(ParseWithUnit(text, kUnits, "in bytes, kB, MB, GB or TB", option), kAny);
}

double ParseDuration(const std::string& text, const std::string& option) {
  constexpr std::pair<const char*, double> kUnits[] = {{"", 1}, {"s", 1}, {"m", 60}, {"h", 3600}, {"d", 86400}};
  return ParseWithUnit(text, kUnits, "in seconds, or as in 90s, 30m, 12h, 7d", option);
}

std::string LongName(const std::string& names) { return names.substr(names.rfind(',') + 1); }

CLI::Option* AddNumber(CLI::App& app, const std::string& name, const char* metavariable, const NumberRule& rule,
                       const std::function<void(double)>& set, const std::string& help) {
  return app
      .add_option_function<std::string>(
          name, [=](const std::string& text) { set(CheckedNumber(text, rule, name)); }, help)
      ->type_name(metavariable);
}

}  // namespace dlcs::client
