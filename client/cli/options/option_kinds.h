// SPDX-License-Identifier: Apache-2.0
// Kinds of options: numbers with a rule, words, times. Includes CLI11, which is slow to compile; only for parsing the
// command line.
//
// Invalid values throw CLI::ValidationError with the option, the value and the rule.

#ifndef DLCS_CLIENT_CLI_OPTIONS_OPTION_KINDS_H_
#define DLCS_CLIENT_CLI_OPTIONS_OPTION_KINDS_H_

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "proto/shared/nearest_name.h"

namespace dlcs::client {

// The rule for a number, in words and as bounds.
struct NumberRule {
  const char* words;
  double least;
  double most = std::numeric_limits<double>::infinity();
  bool whole = false;
  bool of_clock = false;  // seconds that people wait: no suffixes, for many would take 5m for minutes

  bool Holds(double value) const { return value >= least && value <= most && (!whole || value == std::floor(value)); }
};
constexpr NumberRule Positive() { return {"a number above 0", std::numeric_limits<double>::denorm_min()}; }
constexpr NumberRule Seconds() {
  return {.words = "a number of seconds above 0", .least = Positive().least, .of_clock = true};
}
constexpr NumberRule Within(const char* words, double least, double most) { return {words, least, most}; }
constexpr NumberRule Whole(const char* words, double least, double most = 9e15) { return {words, least, most, true}; }

// `text` as a finite number: the same digits as in a file, and unless it is whole or of the clock a suffix as in SPICE,
// such as 1m, 20u, 10k or 1meg.
double CheckedNumber(const std::string& text, const NumberRule& rule, const std::string& option);

// Times such as "0.1,0.5", in any order, and ranges begin:step:end such as 0:0.01:5 or 0:1m:20m. The result is
// increasing and distinct.
std::vector<double> ParseTimes(const std::string& text, const std::string& option);

// The times of `text`, which is a list of them or the name of a file that holds them, separated by commas,
// blanks or new lines.
std::vector<double> ParseTimesOrFile(const std::string& text, const std::string& option);

// Above 0: "8GB", "500MB", "20kB" (decimal), or a number of bytes.
double ParseBytes(const std::string& text, const std::string& option);

// Above 0, in seconds: "90s", "30m", "12h", "7d", or a number of seconds.
double ParseDuration(const std::string& text, const std::string& option);

// The long name of an option, used in messages: "--format" for "-f,--format".
std::string LongName(const std::string& names);

CLI::Option* AddNumber(CLI::App& app, const std::string& name, const char* metavariable, const NumberRule& rule,
                       const std::function<void(double)>& set, const std::string& help);

// An option whose values are words. For an unknown word the error proposes the nearest one, or the one that `meant_by`
// returns.
template <typename Value>
CLI::Option* AddWord(CLI::App& app, const std::string& name, const std::vector<std::string>& words,
                     const std::function<std::optional<Value>(const std::string&)>& parse,
                     const std::function<void(Value)>& set, const std::string& help,
                     const std::function<std::optional<std::string>(const std::string&)>& meant_by = {}) {
  const auto read = [=](const std::string& text) {
    const auto value = parse(text);
    if (value) return set(*value);
    auto meant = meant_by ? meant_by(text) : std::nullopt;
    if (!meant) meant = NearestName(text, words);
    throw CLI::ValidationError(LongName(name),
                               fmt::format("\"{}\" is none of {}{}", text, fmt::join(words, ", "), DidYouMean(meant)));
  };
  return app.add_option_function<std::string>(name, read, help)->type_name(fmt::format("{}", fmt::join(words, "|")));
}

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OPTIONS_OPTION_KINDS_H_
