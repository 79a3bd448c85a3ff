// SPDX-License-Identifier: Apache-2.0
#include "client/files/npy_array.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// An error; thrown and caught in this file only.
struct NpyFault {
  std::string what;
};

// NumPy itself refuses longer headers.
constexpr std::size_t kMaxHeaderBytes = 10'000;

struct NpyLayout {
  std::string type;  // "<f8"
  bool by_columns = false;
  std::vector<std::uint64_t> shape;
};

// Reads the header, a dictionary in Python: {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }
class NpyHeaderReader {
 public:
  explicit NpyHeaderReader(std::string_view text) : text_(text) {}

  NpyLayout Read() {
    NpyLayout layout;
    bool has_type = false, has_order = false, has_shape = false;
    Expect('{');
    while (!Take('}')) {
      const std::string_view key = Quoted();
      Expect(':');
      if (key == "descr" && !std::exchange(has_type, true)) {
        if (Next() == '[') throw NpyFault{"holds records with fields; must hold plain numbers"};
        layout.type = Quoted();
      } else if (key == "fortran_order" && !std::exchange(has_order, true)) {
        layout.by_columns = Truth();
      } else if (key == "shape" && !std::exchange(has_shape, true)) {
        layout.shape = Shape();
      } else {
        throw Unreadable();
      }
      if (!Take(',')) {
        Expect('}');
        break;
      }
    }
    if (!has_type || !has_order || !has_shape) throw Unreadable();
    return layout;
  }

 private:
  static NpyFault Unreadable() {
    return {"has a damaged header; must name descr, fortran_order and shape, as NumPy writes them"};
  }

  char Next() {
    while (position_ < text_.size() && (text_[position_] == ' ' || text_[position_] == '\n')) ++position_;
    return position_ < text_.size() ? text_[position_] : '\0';
  }
  bool Take(char c) {
    const bool here = Next() == c;
    position_ += here ? 1 : 0;
    return here;
  }
  void Expect(char c) {
    if (!Take(c)) throw Unreadable();
  }
  std::string_view Quoted() {
    const char quote = Next();
    if (quote != '\'' && quote != '"') throw Unreadable();
    const std::size_t begin = ++position_;
    const std::size_t end = text_.find(quote, begin);
    if (end == std::string_view::npos) throw Unreadable();
    position_ = end + 1;
    return text_.substr(begin, end - begin);
  }
  bool Truth() {
    Next();
    for (const auto& [word, value] : {std::pair("True", true), std::pair("False", false)}) {
      if (!text_.substr(position_).starts_with(word)) continue;
      position_ += std::string_view(word).size();
      return value;
    }
    throw Unreadable();
  }
  std::vector<std::uint64_t> Shape() {
    std::vector<std::uint64_t> shape;
    Expect('(');
    while (!Take(')')) {
      Next();
      std::uint64_t size = 0;
      const auto [end, error] = std::from_chars(text_.data() + position_, text_.data() + text_.size(), size);
      if (error != std::errc()) throw Unreadable();
      position_ = static_cast<std::size_t>(end - text_.data());
      shape.push_back(size);
      Take('L');  // of Python 2
      if (!Take(',')) {
        Expect(')');
        break;
      }
    }
    return shape;
  }

  std::string_view text_;
  std::size_t position_ = 0;
};

// What a type of NumPy that is not read holds.
const char* ContentOf(char kind) {
  switch (kind) {
    case 'c':
      return "complex numbers";
    case 'O':
      return "Python objects (pickled)";
    case 'S':
    case 'a':
    case 'U':
      return "text";
    case 'm':
    case 'M':
      return "dates or times";
    default:
      return "elements";
  }
}

NumberFormat FormatOf(const std::string& type) {
  constexpr std::string_view kRule = "must hold booleans, integers or floats of at most 64 bits";
  const auto refuse = [&](const char* content) {
    return NpyFault{fmt::format("holds {} of the type \"{}\"; {}", content, TruncateUtf8(type, 40), kRule)};
  };
  if (type.size() < 2) throw refuse("elements");
  NumberFormat format;
  format.big_endian = type[0] == '>' || (type[0] == '=' && std::endian::native == std::endian::big);
  if (std::string_view("<>|=").find(type[0]) == std::string_view::npos) throw refuse("elements");
  const std::string_view size = std::string_view(type).substr(2);
  const auto is = [&](std::initializer_list<const char*> sizes) {
    for (const char* one : sizes) {
      if (size == one) return true;
    }
    return false;
  };
  const char kind = type[1];
  if ((kind == 'b' && is({"1"})) || (kind == 'u' && is({"1", "2", "4", "8"}))) {
    format.kind = NumberFormat::Kind::kUnsigned;
  } else if (kind == 'i' && is({"1", "2", "4", "8"})) {
    format.kind = NumberFormat::Kind::kSigned;
  } else if (kind != 'f' || !is({"2", "4", "8"})) {
    throw refuse(ContentOf(kind));
  }
  format.bytes = static_cast<std::size_t>(size[0] - '0');
  return format;
}

// Splits `bytes` into the header, which is returned, and what follows it.
std::string_view SplitHeader(std::string_view& bytes) {
  constexpr std::size_t kVersionBytes = 2;
  if (!bytes.starts_with(kNpyMagic) || bytes.size() < kNpyMagic.size() + kVersionBytes) {
    throw NpyFault{"is not a NumPy array; must begin with \\x93NUMPY and a version"};
  }
  const int major = static_cast<unsigned char>(bytes[kNpyMagic.size()]);
  if (major < 1 || major > 3) throw NpyFault{fmt::format("is of version {} of .npy; must be 1, 2 or 3", major)};
  const std::size_t length_bytes = major == 1 ? 2 : 4;
  bytes.remove_prefix(kNpyMagic.size() + kVersionBytes);
  if (bytes.size() < length_bytes) throw NpyFault{"ends in its header"};
  std::size_t length = 0;
  for (std::size_t k = length_bytes; k-- > 0;) length = length << 8 | static_cast<unsigned char>(bytes[k]);
  bytes.remove_prefix(length_bytes);
  if (length > kMaxHeaderBytes) {
    throw NpyFault{fmt::format("has a header of {} bytes; must have at most {}", length, kMaxHeaderBytes)};
  }
  if (bytes.size() < length) throw NpyFault{"ends in its header"};
  const std::string_view header = bytes.substr(0, length);
  bytes.remove_prefix(length);
  return header;
}

}  // namespace

absl::StatusOr<StoredArray> ParseNpy(std::string_view bytes, ReadingBudget& budget) {
  try {
    const NpyLayout layout = NpyHeaderReader(SplitHeader(bytes)).Read();
    const NumberFormat format = FormatOf(layout.type);
    if (layout.shape.size() > 2) {
      throw NpyFault{fmt::format("has {} dimensions; must have at most two", layout.shape.size())};
    }
    StoredArray array;
    array.dimensions = static_cast<int>(layout.shape.size());
    const std::uint64_t rows = array.dimensions > 0 ? layout.shape[0] : 1;
    const std::uint64_t columns = array.dimensions > 1 ? layout.shape[1] : 1;
    auto dense = DenseFromBytes(bytes, format, rows, columns, layout.by_columns, budget);
    if (!dense.ok()) return dense.status();
    *array.matrix.mutable_dense() = *std::move(dense);
    return array;
  } catch (const NpyFault& fault) {
    return absl::InvalidArgumentError(fault.what);
  }
}

std::string NpyHeader(std::string_view type, std::span<const std::size_t> shape) {
  constexpr char kOrder = std::endian::native == std::endian::little ? '<' : '>';
  std::string text = fmt::format("{{'descr': '{}{}', 'fortran_order': False, 'shape': ({}{}), }}", kOrder, type,
                                 fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
  // The elements begin at a multiple of 64 bytes.
  constexpr std::size_t kBefore = 10;  // magic, version and length
  text.append(63 - (kBefore + text.size()) % 64, ' ');
  text += '\n';
  std::string header(kNpyMagic);
  header += {'\1', '\0', static_cast<char>(text.size() & 0xff), static_cast<char>(text.size() >> 8)};
  return header + text;
}

}  // namespace dlcs::client
