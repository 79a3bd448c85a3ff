// SPDX-License-Identifier: Apache-2.0
#include "server/config/config_file.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <regex>
#include <sstream>

#include "fmt/format.h"
#include "proto/shared/byte_order_mark.h"

namespace dlcs {
namespace {

// All settings together take some thousand bytes; a larger file is a file of another kind.
constexpr std::size_t kMaxFileBytes = 1'000'000;
constexpr std::size_t kMaxLineBytes = 4096;
constexpr std::size_t kMaxShownBytes = 2 * kMaxLineBytes;  // a line, and a message about it

constexpr const char* kBlanks = " \t\r";

std::string Trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

bool IsComment(const std::string& text) { return text.empty() || text.front() == '#'; }

// The value after "=", or the rule that it breaks.
struct Value {
  std::string text;
  const char* broken_rule = nullptr;
};

Value ReadQuoted(const std::string& text) {
  const std::size_t end = text.find(text.front(), 1);
  if (end == std::string::npos) return {"", "a quote is not closed on its line"};
  if (!IsComment(Trimmed(text.substr(end + 1)))) return {"", "only a comment may follow the closing quote"};
  return {text.substr(1, end - 1)};
}

Value ReadValue(const std::string& text) {
  if (IsComment(text)) return {"", "a value must follow \"=\"; \"\" is an empty one"};
  if (text.front() == '"' || text.front() == '\'') return ReadQuoted(text);
  return {Trimmed(text.substr(0, std::min(text.find(" #"), text.find("\t#"))))};
}

bool IsPlain(const std::string& value) {
  return !value.empty() && std::all_of(value.begin(), value.end(), [](unsigned char c) {
    return std::isdigit(c) != 0 || c == '.' || c == '-' || c == '+';
  });
}

}  // namespace

absl::StatusOr<std::vector<Setting>> ReadSettings(std::istream& input, const std::string& path) {
  std::string file(kMaxFileBytes + 1, '\0');
  input.read(file.data(), static_cast<std::streamsize>(file.size()));
  if (input.bad()) return absl::InvalidArgumentError(fmt::format("{}: cannot be read", path));
  file.resize(static_cast<std::size_t>(input.gcount()));
  if (file.size() > kMaxFileBytes) {
    return absl::InvalidArgumentError(
        fmt::format("{}: has more than {} bytes; must be a file of settings, one a line", path, kMaxFileBytes));
  }
  std::vector<Setting> settings;
  std::map<std::string, int> lines;
  int number = 0;
  std::istringstream text_lines{std::string(WithoutByteOrderMark(file))};
  for (std::string line; std::getline(text_lines, line);) {
    ++number;
    if (line.size() > kMaxLineBytes) {
      return absl::InvalidArgumentError(
          fmt::format("{}:{}: has {} bytes; a line must have at most {}", path, number, line.size(), kMaxLineBytes));
    }
    const std::string text = Trimmed(line);
    if (IsComment(text)) continue;
    const auto broken = [&](const std::string& rule) {
      return absl::InvalidArgumentError(fmt::format("{}:{}: {}: {}", path, number, WithoutPassword(text), rule));
    };
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) return broken("must be key = value, or a comment after #");
    const std::string key = Trimmed(text.substr(0, equals));
    if (key.empty()) return broken("a key is missing before \"=\"");
    Value value = ReadValue(Trimmed(text.substr(equals + 1)));
    if (value.broken_rule != nullptr) return broken(value.broken_rule);
    if (const auto [earlier, is_new] = lines.emplace(key, number); !is_new) {
      return broken(fmt::format("was already given in line {}", earlier->second));
    }
    settings.push_back({key, std::move(value.text), number});
  }
  return settings;
}

std::string WriteSetting(const std::string& key, const std::string& value) {
  if (IsPlain(value) || value == "true" || value == "false") return fmt::format("{} = {}", key, value);
  const char quote = value.find('"') == std::string::npos ? '"' : '\'';
  return fmt::format("{} = {}{}{}", key, quote, value, quote);
}

std::string WithoutPassword(const std::string& value) {
  // std::regex uses stack for every character.
  if (value.size() > kMaxShownBytes) return fmt::format("({} bytes)", value.size());
  static const std::regex in_url(R"((://[^/:@\s]*):[^@\s]*@)");
  static const std::regex in_words(R"((password\s*=\s*)('[^']*'|[^\s&"']+))", std::regex::icase);
  return std::regex_replace(std::regex_replace(value, in_url, "$1:***@"), in_words, "$1***");
}

}  // namespace dlcs
