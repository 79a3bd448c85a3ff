// SPDX-License-Identifier: Apache-2.0
#include "client/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <memory>
#include <set>
#include <string_view>
#include <vector>

namespace dlcs::client {
namespace {

constexpr int kMaxDepth = 32;

// Thrown from the parser's callback, which has no other way to stop it, and caught in ParseJson().
struct Refusal {
  std::string what;
};

// What nlohmann's parser lets pass and we do not: a key given twice, deep nesting.
class StructureGuard {
 public:
  bool operator()(int depth, nlohmann::json::parse_event_t event, const nlohmann::json& value) {
    using Event = nlohmann::json::parse_event_t;
    if (event == Event::object_start) {
      keys_.emplace_back();
      open_keys_.emplace_back();
    } else if (event == Event::object_end) {
      keys_.pop_back();
      open_keys_.pop_back();
    } else if (event == Event::key) {
      OnKey(value.get_ref<const std::string&>());
    }
    if (depth > kMaxDepth)
      throw Refusal{fmt::format("lists or objects are nested deeper than {}", kMaxDepth)};
    return true;
  }

 private:
  void OnKey(const std::string& key) {
    if (!keys_.back().insert(key).second) {
      const std::string where = open_keys_.size() > 1 ? fmt::format(" in \"{}\"", open_keys_.front()) : "";
      throw Refusal{fmt::format("key \"{}\" is given twice{}; keep one of them", key, where)};
    }
    open_keys_.back() = key;
  }

  std::vector<std::set<std::string>> keys_;  // of the objects that are open
  std::vector<std::string> open_keys_;       // the key whose value is being read, in each of them
};

struct Place {
  std::size_t line = 1;
  std::size_t column = 1;
};

Place PlaceOf(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, std::min(offset, text.size()));
  Place place;
  place.line += static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  const std::size_t line_start = before.rfind('\n');
  place.column = line_start == std::string_view::npos ? before.size() + 1 : before.size() - line_start;
  return place;
}

bool IsWordLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

// The letters around `offset`: the parser stops somewhere inside a word that it does not know.
std::string WordAt(std::string_view text, std::size_t offset) {
  if (offset >= text.size() || !IsWordLetter(text[offset])) return "";
  std::size_t begin = offset;
  std::size_t end = offset;
  while (begin > 0 && IsWordLetter(text[begin - 1])) --begin;
  while (end < text.size() && IsWordLetter(text[end])) ++end;
  return std::string(text.substr(begin, std::min<std::size_t>(end - begin, 40)));
}

// What people write that JSON does not have; empty when the parser's own words have to do.
std::string Explain(std::string_view text, std::size_t offset) {
  const std::string word = WordAt(text, offset);
  std::string lower = word;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower == "nan" || lower == "inf" || lower == "infinity") {
    return fmt::format("{} is neither JSON nor allowed here; every number must be finite", word);
  }
  if (lower == "true" || lower == "false" || lower == "none") {
    return fmt::format("{} is Python; JSON writes true, false and null", word);
  }
  if (!word.empty())
    return fmt::format("{} is not a JSON value; text, formulas too, stands in double quotes", word);
  if (offset >= text.size()) return "the file ends in the middle; is a bracket or a quote missing?";
  const char found = text[offset];
  if (found == '\'') return "text stands in double quotes in JSON, not in single ones";
  if (found == '/' || found == '#') return "JSON has no comments; put notes into the key \"about\"";
  if (found == ']' || found == '}') {
    const std::size_t previous = text.substr(0, offset).find_last_not_of(" \t\r\n");
    if (previous != std::string_view::npos && text[previous] == ',') {
      return fmt::format("a comma stands before the closing '{}'; remove it", found);
    }
  }
  return "";
}

// The parser's own reason without its prefix "[json.exception...] parse error at line ...: ".
std::string ReasonOf(const std::string& what) {
  const std::size_t reason = what.find(" - ");
  if (reason != std::string::npos) return what.substr(reason + 3);
  const std::size_t prefix = what.find("] ");
  return prefix == std::string::npos ? what : what.substr(prefix + 2);
}

std::string Describe(const std::string& text, const std::string& source,
                     const nlohmann::json::parse_error& error) {
  const std::size_t offset = error.byte > 0 ? error.byte - 1 : 0;
  const Place place = PlaceOf(text, offset);
  std::string why = Explain(text, offset);
  if (why.empty()) why = ReasonOf(error.what());
  return fmt::format("{}, line {}, column {}: {}", source, place.line, place.column, why);
}

absl::Status ErrnoStatus(const std::string& source, int error) {
  const std::string reason = fmt::format("{}: cannot read it: {}", source, std::strerror(error));
  if (error == ENOENT || error == ENOTDIR) {
    return absl::NotFoundError(fmt::format("{}: there is no such file; check the path", source));
  }
  return error == EACCES ? absl::PermissionDeniedError(reason) : absl::FailedPreconditionError(reason);
}

}  // namespace

std::string SourceName(const std::string& path) { return path == "-" ? "standard input" : path; }

absl::StatusOr<std::string> ReadTextFile(const std::string& path, std::size_t limit_bytes) {
  const std::string source = SourceName(path);
  const auto close = [](std::FILE* file) {
    if (file != stdin) std::fclose(file);
  };
  const std::unique_ptr<std::FILE, decltype(close)> file(path == "-" ? stdin : std::fopen(path.c_str(), "rb"),
                                                         close);
  if (file == nullptr) return ErrnoStatus(source, errno);
  std::string text;
  std::vector<char> block(std::size_t{1} << 16);
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), file.get())) {
    if (text.size() + count > limit_bytes) {
      return absl::ResourceExhaustedError(
          fmt::format("{}: larger than {} bytes, the limit of input files", source, limit_bytes));
    }
    text.append(block.data(), count);
  }
  if (std::ferror(file.get()) != 0) return ErrnoStatus(source, errno);
  return text;
}

absl::StatusOr<nlohmann::json> ParseJson(const std::string& text, const std::string& source) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    return absl::InvalidArgumentError(fmt::format("{}: the file is empty", source));
  }
  try {
    StructureGuard guard;
    // By reference: the parser copies its callback.
    return nlohmann::json::parse(
        text, [&guard](int depth, nlohmann::json::parse_event_t event, nlohmann::json& value) {
          return guard(depth, event, value);
        });
  } catch (const Refusal& refusal) {
    return absl::InvalidArgumentError(fmt::format("{}: {}", source, refusal.what));
  } catch (const nlohmann::json::parse_error& error) {
    return absl::InvalidArgumentError(Describe(text, source, error));
  } catch (const nlohmann::json::exception& error) {
    // The only one left is a number such as 1e999.
    return absl::InvalidArgumentError(fmt::format("{}: {}; every number must be finite in double precision",
                                                  source, ReasonOf(error.what())));
  }
}

}  // namespace dlcs::client
