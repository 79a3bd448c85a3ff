// SPDX-License-Identifier: Apache-2.0
#include "client/files/matrix_market.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "client/files/json_text.h"
#include "proto/shared/byte_order_mark.h"

namespace dlcs::client {
namespace {

// An error with its line; thrown and caught in this file only.
struct Fault {
  std::int64_t line;
  std::string what;
};

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

// The words of a text, with their line numbers. Lines that begin with % are comments.
class WordReader {
 public:
  // `line`: that on which `text` begins, of which the first one is no comment.
  explicit WordReader(std::string_view text, std::int64_t line = 1) : text_(text), line_(line) {
    if (line == 1) position_ = text.size() - WithoutByteOrderMark(text).size();
    if (line > 1 && text_.starts_with('%')) SkipLine();
  }

  std::int64_t line() const { return line_; }

  // The words of the first line.
  std::vector<std::string> Header() {
    std::vector<std::string> words;
    while (position_ < text_.size() && text_[position_] != '\n') {
      if (const std::string_view word = WordHere(); !word.empty()) words.emplace_back(word);
    }
    return words;
  }

  bool HasMore() const { return !WordReader(*this).Next().empty(); }
  // Bytes that were read.
  std::size_t position() const { return position_; }

  // Empty at the end.
  std::string_view Next() {
    while (position_ < text_.size()) {
      if (text_[position_] == '\n') {
        ++position_;
        ++line_;
        if (position_ < text_.size() && text_[position_] == '%') SkipLine();
      } else if (const std::string_view word = WordHere(); !word.empty()) {
        return word;
      }
    }
    return {};
  }

 private:
  std::string_view WordHere() {
    while (position_ < text_.size() && IsBlank(text_[position_])) ++position_;
    const std::size_t begin = position_;
    while (position_ < text_.size() && !IsBlank(text_[position_]) && text_[position_] != '\n') ++position_;
    return text_.substr(begin, position_ - begin);
  }

  void SkipLine() { position_ = std::min(text_.find('\n', position_), text_.size()); }

  std::string_view text_;
  std::size_t position_ = 0;
  std::int64_t line_;
};

MarketHead ReadFormat(WordReader& words) {
  std::vector<std::string> header = words.Header();
  for (std::string& word : header) {
    std::transform(word.begin(), word.end(), word.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  if (header.size() != 5 || header[0] != "%%matrixmarket" || header[1] != "matrix") {
    throw Fault{1, "must be \"%%MatrixMarket matrix FORMAT FIELD SYMMETRY\""};
  }
  const auto word = [&](std::size_t k, const char* what, std::initializer_list<const char*> known) {
    for (const char* one : known) {
      if (header[k] == one) return header[k];
    }
    std::string list;
    for (const char* one : known) list += (list.empty() ? "" : ", ") + std::string(one);
    throw Fault{1, fmt::format("the {} is \"{}\"; must be one of {}", what, header[k].substr(0, 40), list)};
  };
  MarketHead format;
  format.is_coordinate = word(2, "format", {"coordinate", "array"}) == "coordinate";
  format.is_pattern = word(3, "field", {"real", "integer", "pattern"}) == "pattern";
  const std::string symmetry = word(4, "symmetry", {"general", "symmetric", "skew-symmetric"});
  format.is_symmetric = symmetry == "symmetric";
  format.is_skew = symmetry == "skew-symmetric";
  if (format.is_pattern && !format.is_coordinate)
    throw Fault{1, "a pattern needs the format \"coordinate\", not \"array\""};
  if (format.is_pattern && format.is_skew) throw Fault{1, "a pattern has no signs, and is not skew-symmetric"};
  return format;
}

template <typename Number>
Number ReadNumber(WordReader& words, const char* what) {
  std::string_view word = words.Next();
  if (word.empty()) throw Fault{words.line(), fmt::format("the file ends where {} is expected", what)};
  const std::string_view shown = word.substr(0, 40);
  if (word.size() > 1 && word[0] == '+') word.remove_prefix(1);
  Number number{};
  std::from_chars_result read = std::from_chars(word.data(), word.data() + word.size(), number);
  if constexpr (std::is_floating_point_v<Number>) {
    // Fortran writes the exponents of its doubles with a D, 1.5D+00.
    if (read.ec == std::errc() && read.ptr < word.data() + word.size() && (*read.ptr == 'D' || *read.ptr == 'd')) {
      std::string copy(word);
      copy[static_cast<std::size_t>(read.ptr - word.data())] = 'e';
      const std::from_chars_result again = std::from_chars(copy.data(), copy.data() + copy.size(), number);
      if (again.ptr == copy.data() + copy.size()) read = {word.data() + word.size(), again.ec};
    }
  }
  const bool whole = read.ec == std::errc() && read.ptr == word.data() + word.size();
  if (!whole) throw Fault{words.line(), fmt::format("\"{}\" where {} is expected", shown, what)};
  return number;
}

double ReadValue(WordReader& words) {
  const double value = ReadNumber<double>(words, "a value");
  if (!std::isfinite(value)) throw Fault{words.line(), fmt::format("{}; every value must be finite", value)};
  return value;
}

std::int64_t ReadSize(WordReader& words, const char* what, std::int64_t most) {
  const auto size = ReadNumber<std::int64_t>(words, what);
  if (size < 1 || size > most) {
    throw Fault{words.line(), fmt::format("{}, {}; must be from 1 to {}", size, what, most)};
  }
  return size;
}

std::int32_t ReadIndex(WordReader& words, const char* what, std::int64_t size) {
  return static_cast<std::int32_t>(ReadSize(words, what, size) - 1);
}

MarketHead ReadHead(WordReader& words) {
  constexpr std::int64_t kMax = std::numeric_limits<std::int32_t>::max();
  MarketHead head = ReadFormat(words);
  head.rows = ReadSize(words, "the number of rows", kMax);
  head.columns = ReadSize(words, "the number of columns", kMax);
  if (head.is_half() && head.rows != head.columns) {
    throw Fault{words.line(),
                fmt::format("{} x {}; must be square where half of it stands for the whole", head.rows, head.columns)};
  }
  if (!head.is_coordinate) return head;
  head.entries = ReadNumber<std::int64_t>(words, "the number of entries");
  if (head.entries < 0) throw Fault{words.line(), fmt::format("{} entries; must be at least 0", head.entries)};
  return head;
}

void ReadEntry(WordReader& words, const MarketHead& head, const MarketEntry& add) {
  const std::int32_t row = ReadIndex(words, "the row of an entry", head.rows);
  const std::int64_t line = words.line();
  const std::int32_t column = ReadIndex(words, "the column of an entry", head.columns);
  if (head.is_skew && row == column) {
    throw Fault{words.line(), "a skew-symmetric matrix has no entries on its diagonal"};
  }
  const double value = head.is_pattern ? 1 : ReadValue(words);
  if (words.line() != line) throw Fault{line, "each entry must have a line of its own"};
  add(row, column, value);
  if (row != column && head.is_half()) add(column, row, head.is_skew ? -value : value);
}

v1::SparseMatrix ReadCoordinates(WordReader& words, const MarketHead& head) {
  v1::SparseMatrix matrix;
  matrix.set_rows(static_cast<std::int32_t>(head.rows));
  matrix.set_columns(static_cast<std::int32_t>(head.columns));
  const auto add = [&matrix](std::int32_t row, std::int32_t column, double value) {
    matrix.add_row_indices(row);
    matrix.add_column_indices(column);
    matrix.add_values(value);
  };
  for (std::int64_t k = 0; k < head.entries; ++k) ReadEntry(words, head, add);
  return matrix;
}

// Column by column, of one triangle the part below the diagonal.
v1::DenseMatrix ReadArray(WordReader& words, const MarketHead& head, std::size_t most_entries) {
  const std::int64_t rows = head.rows, columns = head.columns;
  if (static_cast<std::uint64_t>(rows) > 2 * most_entries / static_cast<std::uint64_t>(columns)) {
    throw Fault{words.line(), fmt::format("this file does not have {} x {} values", rows, columns)};
  }
  v1::DenseMatrix matrix;
  matrix.set_rows(static_cast<std::int32_t>(rows));
  matrix.set_columns(static_cast<std::int32_t>(columns));
  matrix.mutable_values()->Resize(static_cast<int>(rows * columns), 0);
  const auto entry = [&matrix, columns](std::int64_t row, std::int64_t column) -> double& {
    return *matrix.mutable_values()->Mutable(static_cast<int>(row * columns + column));
  };
  for (std::int64_t column = 0; column < columns; ++column) {
    const std::int64_t first = !head.is_half() ? 0 : head.is_skew ? column + 1 : column;
    for (std::int64_t row = first; row < rows; ++row) {
      const double value = ReadValue(words);
      entry(row, column) = value;
      if (head.is_half()) entry(column, row) = head.is_skew ? -value : value;
    }
  }
  return matrix;
}

absl::Status Refused(const Fault& fault, const std::string& source) {
  return absl::InvalidArgumentError(fmt::format("{}, line {}: {}", source, fault.line, fault.what));
}

}  // namespace

absl::StatusOr<MarketHead> ParseMarketHead(std::string_view text, const std::string& source) {
  try {
    WordReader words(text);
    MarketHead head = ReadHead(words);
    head.bytes = words.position();
    head.line = words.line();
    return head;
  } catch (const Fault& fault) {
    return Refused(fault, source);
  }
}

absl::StatusOr<std::int64_t> ParseMarketLines(std::string_view text, std::int64_t line, const MarketHead& head,
                                              const std::string& source, const MarketEntry& add) {
  try {
    WordReader words(text, line);
    std::int64_t entries = 0;
    for (; words.HasMore(); ++entries) ReadEntry(words, head, add);
    return entries;
  } catch (const Fault& fault) {
    return Refused(fault, source);
  }
}

absl::StatusOr<v1::Matrix> ParseMatrixMarket(const std::string& text, const std::string& source) {
  try {
    WordReader words(text);
    const MarketHead head = ReadHead(words);
    v1::Matrix matrix;
    if (head.is_coordinate) {
      *matrix.mutable_sparse() = ReadCoordinates(words, head);
    } else {
      *matrix.mutable_dense() = ReadArray(words, head, text.size());
    }
    if (const std::string_view more = words.Next(); !more.empty()) {
      throw Fault{words.line(), fmt::format("\"{}\" follows the last entry", more.substr(0, 40))};
    }
    return matrix;
  } catch (const Fault& fault) {
    return Refused(fault, source);
  }
}

absl::StatusOr<v1::Matrix> ReadMatrixMarket(const std::string& path) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ParseMatrixMarket(*text, path);
}

}  // namespace dlcs::client
