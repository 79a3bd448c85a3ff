// SPDX-License-Identifier: Apache-2.0
#include "client/files/mat_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// An error of a variable, or of the file; thrown and caught in this file only.
struct MatFault {
  absl::Status status;
};
MatFault MatRefusal(const std::string& what) { return {absl::InvalidArgumentError(what)}; }

std::uint32_t MatWord(std::string_view bytes, std::size_t at, bool big_endian) {
  std::uint32_t word = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    word = word << 8 | static_cast<unsigned char>(bytes[at + (big_endian ? k : 3 - k)]);
  }
  return word;
}

// Unpacks the content of a compressed element bit by bit, so that not more is unpacked than is needed.
class Unpacker {
 public:
  explicit Unpacker(std::string_view packed) {
    stream_.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data()));  // zlib does not write to it
    stream_.avail_in = static_cast<uInt>(packed.size());  // an element is shorter than 4 GB
    if (inflateInit(&stream_) != Z_OK) throw MatFault{absl::ResourceExhaustedError("cannot be unpacked: no memory")};
  }
  ~Unpacker() { inflateEnd(&stream_); }
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  const std::string& content() const { return content_; }

  // Unpacks until `content` has this size, or to the end of what is packed.
  void UnpackTo(std::size_t size) {
    constexpr std::size_t kBlock = std::size_t{1} << 20;
    while (!ended_ && content_.size() < size) {
      const std::size_t before = content_.size();
      const std::size_t block = std::min(kBlock, size - before);
      content_.resize(before + block);
      stream_.next_out = reinterpret_cast<Bytef*>(content_.data() + before);
      stream_.avail_out = static_cast<uInt>(block);
      const int code = inflate(&stream_, Z_NO_FLUSH);
      content_.resize(before + block - stream_.avail_out);
      if (code == Z_STREAM_END) ended_ = true;
      if (code != Z_STREAM_END && code != Z_OK) throw MatRefusal("is damaged, and cannot be unpacked");
    }
  }

 private:
  z_stream stream_ = {};
  std::string content_;
  bool ended_ = false;
};

struct MatElement {
  std::uint32_t type = 0;
  std::string_view data;
};

constexpr std::size_t kTagBytes = 8;

std::size_t PaddedTo8(std::size_t bytes) { return (bytes + 7) / 8 * 8; }

// Takes the next element, with its padding, from `bytes`.
MatElement TakeElement(std::string_view& bytes, bool big_endian) {
  const auto ends = [] { return MatRefusal("is damaged: it ends in the middle of an element"); };
  if (bytes.size() < kTagBytes) throw ends();
  const std::uint32_t first = MatWord(bytes, 0, big_endian);
  MatElement element;
  if (first >> 16 != 0) {  // at most 4 bytes, which share the tag
    const std::size_t size = first >> 16;
    if (size > 4) throw MatRefusal("is damaged: an element has a wrong tag");
    element = {first & 0xffff, bytes.substr(4, size)};
    bytes.remove_prefix(kTagBytes);
    return element;
  }
  const std::size_t size = MatWord(bytes, 4, big_endian);
  if (size > bytes.size() - kTagBytes) throw ends();
  element = {first, bytes.substr(kTagBytes, size)};
  bytes.remove_prefix(std::min(bytes.size(), kTagBytes + PaddedTo8(size)));
  return element;
}

// The header of an array.
struct MatHead {
  std::uint32_t array_class = 0;
  bool complex = false;
  std::vector<std::uint64_t> shape;
  std::string name;
};

MatHead TakeHead(std::string_view& bytes, bool big_endian) {
  MatHead head;
  const MatElement flags = TakeElement(bytes, big_endian);
  if (flags.type != mat::kUint32 || flags.data.size() != 8) throw MatRefusal("is damaged: an array has no flags");
  const std::uint32_t word = MatWord(flags.data, 0, big_endian);
  head.array_class = word & 0xff;
  head.complex = (word & mat::kComplexFlag) != 0;
  MatElement element = TakeElement(bytes, big_endian);
  if (element.type == mat::kInt32) {  // objects of classes have no shape
    for (std::size_t at = 0; at + 4 <= element.data.size(); at += 4) {
      head.shape.push_back(MatWord(element.data, at, big_endian));
    }
    element = TakeElement(bytes, big_endian);
  }
  head.name = std::string(element.data);
  return head;
}

std::optional<NumberFormat> NumberFormatOf(std::uint32_t type, bool big_endian) {
  using Kind = NumberFormat::Kind;
  switch (type) {
    case mat::kInt8:
      return NumberFormat{Kind::kSigned, 1, big_endian};
    case mat::kUint8:
      return NumberFormat{Kind::kUnsigned, 1, big_endian};
    case mat::kInt16:
      return NumberFormat{Kind::kSigned, 2, big_endian};
    case mat::kUint16:
      return NumberFormat{Kind::kUnsigned, 2, big_endian};
    case mat::kInt32:
      return NumberFormat{Kind::kSigned, 4, big_endian};
    case mat::kUint32:
      return NumberFormat{Kind::kUnsigned, 4, big_endian};
    case mat::kSingle:
      return NumberFormat{Kind::kFloat, 4, big_endian};
    case mat::kDouble:
      return NumberFormat{Kind::kFloat, 8, big_endian};
    case mat::kInt64:
      return NumberFormat{Kind::kSigned, 8, big_endian};
    case mat::kUint64:
      return NumberFormat{Kind::kUnsigned, 8, big_endian};
    default:
      return std::nullopt;
  }
}

// What an array that holds no numbers is.
const char* WhatMatClassIs(std::uint32_t array_class) {
  switch (array_class) {
    case mat::kCellClass:
      return "is a cell array";
    case mat::kStructClass:
      return "is a structure";
    case mat::kCharClass:
      return "is text";
    case mat::kFunctionClass:
      return "is a function";
    case mat::kObjectClass:
    case mat::kOpaqueClass:
      return "is an object of a class";
    default:
      return "is of an unknown class";
  }
}

// The numbers of an element.
struct MatNumbers {
  std::string_view data;
  NumberFormat format;

  std::size_t count() const { return data.size() / format.bytes; }
};

MatNumbers TakeNumbers(std::string_view& bytes, bool big_endian) {
  const MatElement element = TakeElement(bytes, big_endian);
  const auto format = NumberFormatOf(element.type, big_endian);
  if (!format || element.data.size() % format->bytes != 0) {
    throw MatRefusal("is damaged: its values are not numbers");
  }
  return {element.data, *format};
}

// Row and column indices of sparse arrays: whole numbers of 32 bits.
MatNumbers TakeIndices(std::string_view& bytes, bool big_endian) {
  MatNumbers numbers = TakeNumbers(bytes, big_endian);
  if (numbers.format.bytes != 4 || numbers.format.kind == NumberFormat::Kind::kFloat) {
    throw MatRefusal("is damaged: its indices are not integers of 32 bits");
  }
  return numbers;
}

// Column by column: the row of each entry, where each column begins, the values.
v1::SparseMatrix ReadSparse(const MatHead& head, std::string_view bytes, bool big_endian, ReadingBudget& budget) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::int32_t>::max();
  const std::uint64_t rows = head.shape[0], columns = head.shape[1];
  if (rows < 1 || rows > kMax || columns < 1 || columns > kMax) {
    throw MatRefusal(fmt::format("is of {} x {}; must have from 1 to {} rows and columns", rows, columns, kMax));
  }
  const MatNumbers row_of = TakeIndices(bytes, big_endian);
  const MatNumbers begins = TakeIndices(bytes, big_endian);
  const MatNumbers values = TakeNumbers(bytes, big_endian);
  const MatFault damaged = MatRefusal("is damaged: its indices do not fit its values");
  if (begins.count() != columns + 1) throw damaged;
  const std::uint32_t entries = MatWord(begins.data, 4 * columns, big_endian);
  if (entries > row_of.count() || entries > values.count()) throw damaged;
  constexpr std::size_t kEntryBytes = 2 * sizeof(std::int32_t) + sizeof(double);
  if (absl::Status taken = budget.Take(entries * kEntryBytes); !taken.ok()) throw MatFault{std::move(taken)};
  v1::SparseMatrix matrix;
  matrix.set_rows(static_cast<std::int32_t>(rows));
  matrix.set_columns(static_cast<std::int32_t>(columns));
  std::uint32_t k = MatWord(begins.data, 0, big_endian);
  if (k != 0) throw damaged;
  for (std::uint64_t column = 0; column < columns; ++column) {
    const std::uint32_t end = MatWord(begins.data, 4 * (column + 1), big_endian);
    if (end < k || end > entries) throw damaged;
    for (; k < end; ++k) {
      const std::uint32_t row = MatWord(row_of.data, 4 * std::size_t{k}, big_endian);
      if (row >= rows) throw damaged;
      const absl::StatusOr<double> value = NumberFromBytes(values.data, values.format, k);
      if (!value.ok()) {
        throw MatRefusal(
            fmt::format("holds in row {}, column {} (from 0) {}", row, column, std::string(value.status().message())));
      }
      matrix.add_row_indices(static_cast<std::int32_t>(row));
      matrix.add_column_indices(static_cast<std::int32_t>(column));
      matrix.add_values(*value);
    }
  }
  return matrix;
}

// `bytes` follow the head.
StoredArray ReadArray(const MatHead& head, std::string_view bytes, bool big_endian, ReadingBudget& budget) {
  const bool sparse = head.array_class == mat::kSparseClass;
  if (!sparse && (head.array_class < mat::kDoubleClass || head.array_class > mat::kUint64Class)) {
    throw MatRefusal(fmt::format("{}; must be an array of numbers", WhatMatClassIs(head.array_class)));
  }
  if (head.complex) throw MatRefusal("holds complex numbers; must hold real numbers");
  if (head.shape.size() != 2) {
    throw MatRefusal(fmt::format("has {} dimensions; must have two", head.shape.size()));
  }
  StoredArray array;
  if (sparse) {
    *array.matrix.mutable_sparse() = ReadSparse(head, bytes, big_endian, budget);
    return array;
  }
  // An empty array may have no values at all.
  const bool empty = head.shape[0] == 0 || head.shape[1] == 0;
  const MatNumbers numbers = empty ? MatNumbers{} : TakeNumbers(bytes, big_endian);
  auto dense = DenseFromBytes(numbers.data, numbers.format, head.shape[0], head.shape[1], /*by_columns=*/true, budget);
  if (!dense.ok()) throw MatFault{dense.status()};
  *array.matrix.mutable_dense() = *std::move(dense);
  return array;
}

// The variables of a file, one after the other.
class MatReader {
 public:
  MatReader(const Wanted& wanted, bool big_endian, ReadingBudget& budget)
      : wanted_(wanted), big_endian_(big_endian), budget_(budget) {}

  StoredVariables Take() { return std::move(variables_); }

  // The content of an array.
  void Add(std::string_view bytes) {
    const MatHead head = TakeHead(bytes, big_endian_);
    if (IsWanted(head.name)) Read(head, bytes);
  }

  // A compressed element, which holds one array. Only the begin of one that is not wanted is unpacked.
  void AddPacked(std::string_view packed) {
    constexpr std::size_t kLongestHead = 4096;  // names have at most 63 letters
    Unpacker unpacker(packed);
    unpacker.UnpackTo(kLongestHead);
    if (unpacker.content().size() < kTagBytes) throw MatRefusal("is damaged: a packed element is empty");
    if (MatWord(unpacker.content(), 0, big_endian_) != mat::kMatrix) return;  // what the program keeps for itself
    const std::size_t size = kTagBytes + std::size_t{MatWord(unpacker.content(), 4, big_endian_)};
    const std::string_view begin = std::string_view(unpacker.content()).substr(kTagBytes);
    std::string_view rest = begin;
    const MatHead head = TakeHead(rest, big_endian_);
    if (!IsWanted(head.name)) return;
    const std::size_t head_bytes = begin.size() - rest.size();
    try {
      if (absl::Status taken = budget_.Take(size); !taken.ok()) throw MatFault{std::move(taken)};
      unpacker.UnpackTo(size);
    } catch (const MatFault& fault) {
      variables_.arrays.insert_or_assign(head.name, fault.status);
      return;
    }
    Read(head, std::string_view(unpacker.content()).substr(kTagBytes + head_bytes));
  }

 private:
  bool IsWanted(const std::string& name) {
    if (name.empty()) return false;  // what MATLAB keeps for its functions
    if (std::ranges::find(variables_.names, name) != variables_.names.end()) {
      throw MatRefusal(fmt::format("holds \"{}\" twice; names must be unique", TruncateUtf8(name, 40)));
    }
    variables_.names.push_back(name);
    return wanted_(name);
  }

  void Read(const MatHead& head, std::string_view bytes) {
    try {
      variables_.arrays.insert_or_assign(head.name, ReadArray(head, bytes, big_endian_, budget_));
    } catch (const MatFault& fault) {
      variables_.arrays.insert_or_assign(head.name, fault.status);
    }
  }

  const Wanted& wanted_;
  bool big_endian_;
  ReadingBudget& budget_;
  StoredVariables variables_;
};

constexpr std::string_view kLevel5 = "MATLAB 5.0 MAT-file";
constexpr std::string_view kLevel73 = "MATLAB 7.3 MAT-file";

// Many variables are a mistake, and make a file of a few megabytes slow to read.
constexpr std::size_t kMaxVariables = 10'000;

}  // namespace

bool IsMatFile(std::string_view bytes) { return bytes.starts_with(kLevel5) || bytes.starts_with(kLevel73); }

absl::StatusOr<StoredVariables> ParseMat(std::string_view bytes, const Wanted& wanted, ReadingBudget& budget) {
  try {
    if (bytes.starts_with(kLevel73)) {
      throw MatRefusal("is a MAT file of version 7.3; save it with -v7, which keeps the same numbers");
    }
    if (bytes.size() < mat::kHeaderBytes) throw MatRefusal("is damaged: it ends in its header");
    const std::string_view order = bytes.substr(mat::kHeaderBytes - 2, 2);
    if (order != "IM" && order != "MI") throw MatRefusal("is damaged: its header does not say the order of bytes");
    const bool big_endian = order == "MI";
    bytes.remove_prefix(mat::kHeaderBytes);
    MatReader reader(wanted, big_endian, budget);
    for (std::size_t count = 0; !bytes.empty(); ++count) {
      if (count == kMaxVariables) throw MatRefusal(fmt::format("holds more than {} variables", kMaxVariables));
      const std::string_view before = bytes;
      const MatElement element = TakeElement(bytes, big_endian);
      if (element.type == mat::kCompressed) {
        reader.AddPacked(element.data);
        bytes = before.substr(static_cast<std::size_t>(element.data.end() - before.begin()));  // has no padding
      } else if (element.type == mat::kMatrix) {
        reader.Add(element.data);
      } else {
        throw MatRefusal(fmt::format("is damaged: an element is of the type {}", element.type));
      }
    }
    return reader.Take();
  } catch (const MatFault& fault) {
    return fault.status;
  }
}

}  // namespace dlcs::client
