// SPDX-License-Identifier: Apache-2.0
#include "client/files/json_text.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/files/encoding.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kMaxDepth = 32;
// Of a file: each takes a hundred bytes or two, and may be written with two.
constexpr std::size_t kMaxLists = std::size_t{1} << 23;

constexpr std::size_t kMaxShownText = 200;  // of text from the file in messages

// Builds the value while it is read, and stops at errors that nlohmann's own reader accepts: duplicate keys and deep
// nesting. (A callback of that reader could stop it too, but the reader then scans all elements of a list again after
// each nested list or object.)
class StrictReader final : public nlohmann::json_sax<nlohmann::json> {
 public:
  nlohmann::json& value() { return root_; }
  // Why the text is refused; empty if it is not refused, or by the parser itself.
  const std::string& refusal() const { return refusal_; }
  const std::optional<nlohmann::json::parse_error>& syntax_error() const { return syntax_error_; }
  // A number that is larger than all doubles, and how far the parser has read.
  struct TooLarge {
    std::string number;
    std::size_t read = 0;
  };
  const TooLarge& too_large() const { return too_large_; }

  bool null() override { return Put(nullptr); }
  bool boolean(bool value) override { return Put(value); }
  bool number_integer(number_integer_t value) override { return Put(value); }
  bool number_unsigned(number_unsigned_t value) override { return Put(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return Put(value); }
  bool string(string_t& value) override { return Put(std::move(value)); }
  bool binary(binary_t& /*value*/) override { return false; }  // JSON text has none
  bool start_array(std::size_t /*elements*/) override { return Enter(nlohmann::json::array()); }
  bool end_array() override { return Leave(); }
  bool start_object(std::size_t /*elements*/) override { return Enter(nlohmann::json::object()); }
  bool end_object() override { return Leave(); }
  bool key(string_t& key) override {
    Open& object = open_.back();
    if (object.value->contains(key)) {
      const auto first =
          std::find_if(open_.begin(), open_.end() - 1, [](const Open& open) { return open.value->is_object(); });
      const std::string where =
          first != open_.end() - 1 ? fmt::format(" in \"{}\"", TruncateUtf8(first->key, kMaxShownText)) : "";
      refusal_ = fmt::format("key \"{}\" is given twice{}; keep one of them", TruncateUtf8(key, kMaxShownText), where);
      return false;
    }
    object.key = std::move(key);
    return true;
  }
  bool parse_error(std::size_t position, const std::string& token, const nlohmann::detail::exception& error) override {
    if (const auto* syntax = dynamic_cast<const nlohmann::json::parse_error*>(&error)) {
      syntax_error_.emplace(*syntax);
    } else {
      too_large_ = {token, position};  // nothing else is left
    }
    return false;
  }

 private:
  // A list or an object that is being read. Its address is stable, since its container grows only after it is complete.
  struct Open {
    nlohmann::json* value;
    std::string key = {};  // of an object: whose value comes next, or is being read
  };

  nlohmann::json* Add(nlohmann::json value) {
    if (open_.empty()) return &(root_ = std::move(value));
    Open& inner = open_.back();
    if (inner.value->is_array()) return &inner.value->emplace_back(std::move(value));
    return &((*inner.value)[inner.key] = std::move(value));
  }
  bool Put(nlohmann::json value) {
    Add(std::move(value));
    return true;
  }
  bool Enter(nlohmann::json empty) {
    if (open_.size() == kMaxDepth) {
      refusal_ = fmt::format("lists or objects are nested deeper than {}", kMaxDepth);
      return false;
    }
    if (++lists_ > kMaxLists) {
      refusal_ = fmt::format(
          "holds more than {} lists and objects; write a large matrix with \"row_indices\", \"column_indices\" and "
          "\"values\", or as a file of Matrix Market",
          kMaxLists);
      return false;
    }
    open_.push_back({Add(std::move(empty))});
    return true;
  }
  bool Leave() {
    open_.pop_back();
    return true;
  }

  nlohmann::json root_;
  std::vector<Open> open_;
  std::size_t lists_ = 0;
  std::string refusal_;
  TooLarge too_large_;
  std::optional<nlohmann::json::parse_error> syntax_error_;
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

// The word around `offset`: the parser stops somewhere inside an unknown word.
std::string WordAt(std::string_view text, std::size_t offset) {
  if (offset >= text.size() || !IsWordLetter(text[offset])) return "";
  std::size_t begin = offset;
  std::size_t end = offset;
  while (begin > 0 && IsWordLetter(text[begin - 1])) --begin;
  while (end < text.size() && IsWordLetter(text[end])) ++end;
  return std::string(text.substr(begin, std::min<std::size_t>(end - begin, 40)));
}

// A message for common errors that are not JSON; empty if only the parser's message applies.
std::string Explain(std::string_view text, std::size_t offset) {
  const std::string word = WordAt(text, offset);
  std::string lower = word;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower == "nan" || lower == "inf" || lower == "infinity") {
    return fmt::format("{} is not JSON; every number must be finite", word);
  }
  if (lower == "true" || lower == "false" || lower == "none") {
    return fmt::format("{} is Python; JSON writes true, false and null", word);
  }
  if (!word.empty()) return fmt::format("{} is not a JSON value; text, formulas too, needs double quotes", word);
  if (offset >= text.size()) return "the file ends in the middle; is a bracket or a quote missing?";
  const char found = text[offset];
  if (found == '\'') return "text in JSON needs double quotes, not single ones";
  if (found == '/' || found == '#') return "JSON has no comments; put notes into the key \"about\"";
  if (found == ']' || found == '}') {
    const std::size_t previous = text.substr(0, offset).find_last_not_of(" \t\r\n");
    if (previous != std::string_view::npos && text[previous] == ',') {
      return fmt::format("there is a comma before the closing '{}'; remove it", found);
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

// Files that are not text, recognized by their first bytes.
struct Signature {
  std::string_view bytes;
  const char* what;
};
constexpr std::array kSignatures = {
    Signature{"\x7f"
              "ELF",
              "a program"},
    Signature{"\x1f\x8b", "compressed by gzip; unpack it first"},
    Signature{"PK\x03\x04", "a zip archive (.zip, .npz, .xlsx); unpack or export it first"},
    Signature{"BZh", "compressed by bzip2; unpack it first"},
    Signature{"\xfd"
              "7zXZ",
              "compressed by xz; unpack it first"},
    Signature{"\x89HDF", "an HDF5 file"},
    Signature{"MATLAB", "a file of MATLAB"},
    Signature{"\x93NUMPY", "an array of NumPy (.npy)"},
    Signature{"%PDF", "a PDF document"},
    Signature{"\x89PNG", "a picture"},
    Signature{"SQLite format 3", "a database of SQLite"}};

// What `text` is if it is not UTF-8; empty if it is.
std::string ExplainEncoding(const std::string& text) {
  constexpr const char* kWanted = "a text file with JSON in UTF-8 is expected here";
  if (const std::string wide = ExplainWideEncoding(text); !wide.empty()) return ": " + wide;
  for (const Signature& signature : kSignatures) {
    if (text.starts_with(signature.bytes)) return fmt::format(": is {}; {}", signature.what, kWanted);
  }
  if (const std::size_t zero = text.find('\0'); zero != std::string::npos) {
    return fmt::format(": is a binary file (byte {} is zero); {}", zero + 1, kWanted);
  }
  const std::size_t at = FindInvalidUtf8(text);
  if (at == std::string::npos) return "";
  const auto byte = static_cast<unsigned char>(text[at]);
  const std::string letter = byte >= 0xa0 ? fmt::format(" (in Latin-1 it is \"{}\")", FromLatin1({&text[at], 1})) : "";
  const Place place = PlaceOf(text, at);
  return fmt::format(
      ", line {}, column {}: the byte {:#04x} is not UTF-8{}; save the file as UTF-8, or convert it with "
      "iconv -f LATIN1 -t UTF-8",
      place.line, place.column, byte, letter);
}

// If the parser found a value directly after another: the begin of the second one.
std::optional<std::size_t> FindMissingComma(std::string_view text, std::size_t offset, const std::string& reason) {
  const auto has = [&reason](const char* part) { return reason.find(part) != std::string::npos; };
  if (!has("expected '}'") && !has("expected ']'")) return std::nullopt;
  if (has("unexpected '['") || has("unexpected '{'")) return offset;
  if (has("unexpected string literal")) {
    const std::size_t quote = offset > 0 ? text.rfind('"', offset - 1) : std::string_view::npos;
    return quote == std::string_view::npos ? offset : quote;
  }
  if (!has("unexpected number literal")) return std::nullopt;
  while (offset > 0 && std::string_view("+-.eE0123456789").find(text[offset - 1]) != std::string_view::npos) --offset;
  return offset;
}

// If `text` is something else from its begin, such as YAML, a table or a program: where it begins.
std::optional<std::size_t> FindForeignBegin(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  // Quotes and comments have messages of their own.
  if (begin == std::string_view::npos || std::string_view("{[\"'/#").find(text[begin]) != std::string_view::npos) {
    return std::nullopt;
  }
  return begin;
}

std::string FirstWord(std::string_view text) {
  return TruncateUtf8(std::string(text.substr(0, text.find_first_of(" \t\r\n"))), 40);
}

std::string Describe(const std::string& text, const std::string& source, const nlohmann::json::parse_error& error) {
  std::size_t offset = std::min(error.byte > 0 ? error.byte - 1 : 0, text.size());
  const std::string reason = ReasonOf(error.what());
  std::string why;
  if (const auto begin = FindForeignBegin(text)) {
    offset = *begin;
    why = fmt::format("begins with \"{}\"; JSON is one object {{\"KEY\": VALUE, ...}}, with its keys in double quotes",
                      FirstWord(std::string_view(text).substr(offset)));
  } else if (reason.find("; expected end of input") != std::string::npos) {
    why = "there is something after the end of the object; a file holds one";
  } else if (const auto second = FindMissingComma(text, offset, reason)) {
    offset = *second;
    why = fmt::format("a comma is missing before {}",
                      TruncateUtf8(text.substr(offset, text.find_first_of(" \t\r\n,]}:", offset + 1) - offset), 40));
  } else if (reason.find("expected ':'") != std::string::npos) {
    why = "a colon is missing after the key";
  } else {
    why = Explain(text, offset);
  }
  const Place place = PlaceOf(text, offset);
  if (why.empty()) why = TruncateUtf8(reason, kMaxShownText);
  return fmt::format("{}, line {}, column {}: {}", source, place.line, place.column, why);
}

absl::Status ErrnoStatus(const std::string& source, int error) {
  const std::string reason = fmt::format("{}: cannot read it: {}", source, std::strerror(error));
  if (error == ENOENT || error == ENOTDIR) {
    return absl::NotFoundError(fmt::format("{}: there is no such file; check the path", source));
  }
  if (error == EISDIR) return absl::FailedPreconditionError(fmt::format("{}: is a folder; name a file in it", source));
  return error == EACCES ? absl::PermissionDeniedError(reason) : absl::FailedPreconditionError(reason);
}

}  // namespace

std::string SourceName(const std::string& path) { return path == "-" ? "standard input" : path; }

absl::StatusOr<std::string> ReadTextFile(const std::string& path, std::size_t limit_bytes) {
  auto bytes = ReadFileBytes(path, limit_bytes);
  if (!bytes.ok()) return bytes;
  return TextOf(*std::move(bytes));
}

absl::StatusOr<std::string> ReadFileBytes(const std::string& path, std::size_t limit_bytes) {
  const std::string source = SourceName(path);
  const auto close = [](std::FILE* file) {
    if (file != stdin) std::fclose(file);
  };
  const std::unique_ptr<std::FILE, decltype(close)> file(path == "-" ? stdin : std::fopen(path.c_str(), "rb"), close);
  if (file == nullptr) return ErrnoStatus(source, errno);
  std::string text;
  // While text grows, it is in memory twice. A pipe has no size.
  if (struct stat about{}; fstat(fileno(file.get()), &about) == 0 && S_ISREG(about.st_mode)) {
    text.reserve(std::min(static_cast<std::size_t>(about.st_size), limit_bytes));
  }
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
  // The parser would take a zero byte for the end of the text.
  const bool has_zeros = text.find('\0') != std::string::npos;
  StrictReader reader;
  if (!has_zeros && nlohmann::json::sax_parse(text, &reader)) return std::move(reader.value());
  if (!reader.refusal().empty()) {
    return absl::InvalidArgumentError(fmt::format("{}: {}", source, reader.refusal()));
  }
  if (const std::string encoding = ExplainEncoding(text); !encoding.empty()) {
    return absl::InvalidArgumentError(source + encoding);
  }
  if (reader.syntax_error()) return absl::InvalidArgumentError(Describe(text, source, *reader.syntax_error()));
  const StrictReader::TooLarge& found = reader.too_large();
  const Place place = PlaceOf(text, text.rfind(found.number, found.read));
  return absl::InvalidArgumentError(
      fmt::format("{}, line {}, column {}: {} is too large; every number must be finite in "
                  "double precision",
                  source, place.line, place.column, TruncateUtf8(found.number, kMaxShownText)));
}

}  // namespace dlcs::client
