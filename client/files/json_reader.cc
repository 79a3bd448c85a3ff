// SPDX-License-Identifier: Apache-2.0
#include "client/files/json_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <limits>
#include <utility>

#include "client/result/names.h"
#include "proto/shared/nearest_name.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kMaxRefusals = 20;
constexpr std::size_t kMaxShownBytes = 40;

// Keys that people use for the notes of a file, and the right keys.
std::optional<std::string> NoteMeantBy(const std::string& key) {
  constexpr std::array kMeant = {
      std::pair("title", "name"),           std::pair("label", "name"),        std::pair("note", "about"),
      std::pair("notes", "about"),          std::pair("comment", "about"),     std::pair("comments", "about"),
      std::pair("description", "about"),    std::pair("info", "about"),        std::pair("unit", "about"),
      std::pair("units", "about"),          std::pair("author", "source"),     std::pair("reference", "source"),
      std::pair("constants", "parameters"), std::pair("params", "parameters"), std::pair("variables", "states"),
      std::pair("schema", "$schema")};
  std::string lower = key;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const auto& [word, meant] : kMeant) {
    if (lower == word) return meant;
  }
  return std::nullopt;
}

std::string Quoted(const std::string& word) { return '"' + word + '"'; }

// A number with letters behind it, as in "2ms". Times are written out, in seconds: other units may be anything.
std::string HintOnUnit(const std::string& text) {
  constexpr std::array kTimes = {std::pair("s", 0),   std::pair("sec", 0), std::pair("ms", -3), std::pair("us", -6),
                                 std::pair("µs", -6), std::pair("ns", -9), std::pair("ps", -12)};
  if (text.size() > kMaxShownBytes) return "";
  const std::size_t digits = text.find_first_not_of("+-.0123456789");
  if (digits == 0 || digits == std::string::npos) return "";
  const auto number = nlohmann::json::parse(text.substr(0, digits), nullptr, /*allow_exceptions=*/false);
  if (!number.is_number()) return "";
  const std::size_t begin = std::min(text.find_first_not_of(' ', digits), text.size());
  const std::string unit = text.substr(begin);
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0 || c >= 0x80; };
  if (unit.empty() || !std::all_of(unit.begin(), unit.end(), is_letter)) return "";
  const std::string rule = "; numbers have no units";
  for (const auto& [name, exponent] : kTimes) {
    if (unit != name) continue;
    const std::string power = exponent == 0 ? "" : fmt::format("e{}", exponent);
    return fmt::format("{}: in seconds write {}{}", rule, number.dump(), power);
  }
  return rule;
}

// The numbers of a column [[1], [2]] or of a row [[1, 2]], which people write for a vector; none if `value` is neither.
nlohmann::json NumbersInside(const nlohmann::json& value) {
  const bool is_row = value.size() == 1;
  nlohmann::json numbers = nlohmann::json::array();
  for (const nlohmann::json& inner : value) {
    if (!inner.is_array() || inner.empty() || !(is_row || inner.size() == 1)) return nlohmann::json::array();
    for (const nlohmann::json& number : inner) {
      if (!number.is_number()) return nlohmann::json::array();
      numbers.push_back(number);
    }
  }
  return numbers;
}

bool LooksLikeANumber(const nlohmann::json& value) {
  if (!value.is_string()) return false;
  const std::string& text = value.get_ref<const std::string&>();
  // No number is long, and other long text may be nested to any depth.
  return text.size() <= kMaxShownBytes && nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false).is_number();
}

}  // namespace

std::string DescribeJson(const nlohmann::json& value) {
  switch (value.type()) {
    case nlohmann::json::value_t::null:
      return "null";
    case nlohmann::json::value_t::boolean:
      return value.dump();
    case nlohmann::json::value_t::string:
      // Cut before it is quoted, since the string may be very long.
      return fmt::format("a string ({})",
                         TruncateUtf8(nlohmann::json(value.get_ref<const std::string&>().substr(0, kMaxShownBytes))
                                          .dump(-1, ' ', false, nlohmann::json::error_handler_t::ignore),
                                      kMaxShownBytes));
    case nlohmann::json::value_t::array:
      return value.empty() ? "an empty list" : fmt::format("a list (of {})", value.size());
    case nlohmann::json::value_t::object:
      return "an object";
    case nlohmann::json::value_t::number_integer:
    case nlohmann::json::value_t::number_unsigned:
    case nlohmann::json::value_t::number_float:
      return fmt::format("a number ({})", value.dump());
    case nlohmann::json::value_t::binary:
    case nlohmann::json::value_t::discarded:
      break;
  }
  return "not JSON";
}

const std::vector<std::string>& NoteKeys() {
  static const std::vector<std::string> keys = {"name", "about", "source", "$schema"};
  return keys;
}

void JsonReader::Refuse(const std::string& path, const std::string& rule) {
  if (refusals_.size() == kMaxRefusals) {
    ++more_;
  } else {
    refusals_.push_back(fmt::format("{}: {} {}", source_, path, rule));
  }
}

void JsonReader::RefuseUnknownKeys(const nlohmann::json& object, const std::vector<std::string>& known,
                                   const std::string& path, const std::vector<std::string>& notes) {
  std::vector<std::string> listed = known;
  if (path.empty()) listed.insert(listed.end(), NoteKeys().begin(), NoteKeys().end());
  for (const auto& [key, value] : object.items()) {
    if (std::find(listed.begin(), listed.end(), key) != listed.end()) continue;
    if (std::find(notes.begin(), notes.end(), key) != notes.end()) continue;
    if (refusals_.size() == kMaxRefusals) {  // more errors would not be printed
      ++more_;
      continue;
    }
    std::optional<std::string> nearest = NoteMeantBy(key);
    if (nearest && std::find(listed.begin(), listed.end(), *nearest) == listed.end()) nearest.reset();
    if (!nearest) nearest = NearestName(key, listed);
    const std::string where = path.empty() ? "" : fmt::format(" in {}", path);
    Refuse(Quoted(TruncateUtf8(key, kMaxShownBytes)),
           nearest ? fmt::format("is not a known key{}{}", where, DidYouMean(Quoted(*nearest)))
                   : fmt::format("is not a known key{}; known are {}", where, fmt::join(listed, ", ")));
  }
}

const nlohmann::json* JsonReader::Require(const nlohmann::json& object, const std::string& key,
                                          const std::string& rule) {
  const auto found = object.find(key);
  if (found != object.end()) return &*found;
  Refuse(fmt::format("\"{}\"", key), "is missing; " + rule);
  return nullptr;
}

std::optional<double> JsonReader::ReadNumber(const nlohmann::json& value, const std::string& path) {
  if (value.is_number()) return value.get<double>();
  std::string hint = LooksLikeANumber(value) ? "; write it without quotes" : "";
  if (hint.empty() && value.is_string()) hint = HintOnUnit(value.get_ref<const std::string&>());
  const char* null_hint = value.is_null() ? " (was a number not finite, and written as null?)" : "";
  Refuse(path, fmt::format("is {}; must be a number{}{}", DescribeJson(value), hint, null_hint));
  return std::nullopt;
}

std::optional<std::string> JsonReader::ReadString(const nlohmann::json& value, const std::string& path) {
  if (value.is_string()) return value.get<std::string>();
  Refuse(path, fmt::format("is {}; must be text in double quotes", DescribeJson(value)));
  return std::nullopt;
}

std::optional<std::vector<double>> JsonReader::ReadNumbers(const nlohmann::json& value, const std::string& path) {
  if (!value.is_array()) {
    Refuse(path, fmt::format("is {}; must be a list of numbers", DescribeJson(value)));
    return std::nullopt;
  }
  if (const nlohmann::json inside = NumbersInside(value); !inside.empty()) {
    const std::string flat = inside.dump();
    Refuse(path, fmt::format("is a list of {} list{}; must be a list of numbers{}", value.size(),
                             value.size() == 1 ? "" : "s",
                             flat.size() <= kMaxShownBytes ? ": " + flat : ", without lists inside"));
    return std::nullopt;
  }
  std::vector<double> numbers;
  numbers.reserve(value.size());
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (value[i].is_number()) {
      numbers.push_back(value[i].get<double>());
    } else {
      ReadNumber(value[i], fmt::format("{}[{}]", path, i));  // records the error
    }
  }
  if (numbers.size() != value.size()) return std::nullopt;
  return numbers;
}

std::optional<double> JsonReader::ReadEntry(const nlohmann::json& value, const std::string& path,
                                            std::string& formula) {
  if (!value.is_string() || LooksLikeANumber(value)) return ReadNumber(value, path);
  formula = value.get<std::string>();
  return 0;
}

std::optional<v1::DenseMatrix> JsonReader::ReadMatrix(const nlohmann::json& value, const std::string& path,
                                                      bool may_have_formulas) {
  if (!value.is_array() || value.empty() || value[0] == nlohmann::json::array()) {
    const bool empty_row = value.is_array() && !value.empty();
    Refuse(path, fmt::format("is {}; must be a list of rows, each a list of at least one number",
                             empty_row ? "a list of empty rows" : DescribeJson(value)));
    return std::nullopt;
  }
  constexpr std::size_t kMaxDimension = std::numeric_limits<std::int32_t>::max();
  if (value.size() > kMaxDimension) {
    Refuse(path, fmt::format("has {} rows; at most {} are possible", value.size(), kMaxDimension));
    return std::nullopt;
  }
  v1::DenseMatrix matrix;
  bool sound = true;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string row_path = fmt::format("{}[{}]", path, i);
    if (value[i].is_number()) {
      Refuse(row_path,
             fmt::format("is {}; every row is a list, and a column is written [[1], [2]]", DescribeJson(value[i])));
      return std::nullopt;
    }
    const bool has_text = may_have_formulas && value[i].is_array() &&
                          std::any_of(value[i].begin(), value[i].end(), [](const auto& v) { return v.is_string(); });
    nlohmann::json numbers;  // of a row with formulas, with 0 in their places
    if (has_text) numbers = value[i];
    for (std::size_t j = 0; j < numbers.size(); ++j) {
      if (!numbers[j].is_string()) continue;
      std::string formula;
      sound = ReadEntry(numbers[j], fmt::format("{}[{}]", row_path, j), formula) && sound;
      numbers[j] = 0;
      v1::EntryFormula& entry = *matrix.add_formulas();
      entry.set_index(matrix.values_size() + static_cast<int>(j));
      entry.set_formula(std::move(formula));
    }
    const auto row = ReadNumbers(has_text ? numbers : value[i], row_path);
    if (!row) {
      sound = false;
      continue;
    }
    if (value[0].is_array() && row->size() != value[0].size()) {
      Refuse(row_path, fmt::format("has length {}, but {}[0] has length {}; all rows must have the same", row->size(),
                                   path, value[0].size()));
      sound = false;
      continue;
    }
    matrix.mutable_values()->Add(row->begin(), row->end());
  }
  if (!sound) return std::nullopt;
  matrix.set_rows(static_cast<std::int32_t>(value.size()));
  matrix.set_columns(static_cast<std::int32_t>(value[0].size()));
  return matrix;
}

std::optional<std::string> JsonReader::ReadWord(const nlohmann::json& value, const std::string& path,
                                                const std::vector<std::string>& words) {
  const auto text = ReadString(value, path);
  if (!text || std::find(words.begin(), words.end(), *text) != words.end()) return text;
  const std::string shown = TruncateUtf8(*text, kMaxShownBytes);
  const std::optional<std::string> nearest = NearestName(shown, words);
  Refuse(path, fmt::format("is {}; must be one of {}{}", Quoted(shown), fmt::join(words, ", "),
                           nearest ? DidYouMean(Quoted(*nearest)) : ""));
  return std::nullopt;
}

std::optional<v1::SolutionRule> JsonReader::ReadRule(const nlohmann::json& value, const std::string& path) {
  const auto word = ReadWord(value, path, Words<v1::SolutionRule>());
  return word ? ParseWord<v1::SolutionRule>(*word) : std::nullopt;
}

absl::Status JsonReader::status() const {
  if (refusals_.empty()) return absl::OkStatus();
  std::string message = fmt::format("{}", fmt::join(refusals_, "\n"));
  if (more_ > 0) message += fmt::format("\n{}: and {} more", source_, more_);
  return absl::InvalidArgumentError(message);
}

}  // namespace dlcs::client
