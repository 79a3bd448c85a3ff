// SPDX-License-Identifier: Apache-2.0
// MAT files of level 5. (client/files/mat_file.h says where they are described.)
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>

#include "client/cli/output/result_arrays.h"
#include "client/files/mat_file.h"

namespace dlcs::client {
namespace {

// MATLAB reads no larger variables of this level.
constexpr std::uint64_t kMaxVariableBytes = std::numeric_limits<std::int32_t>::max();

std::uint64_t PaddedSize(std::uint64_t bytes) { return (bytes + 7) / 8 * 8; }

template <typename Number>
void AppendRaw(Number number, std::string& bytes) {
  std::array<char, sizeof number> raw;
  std::memcpy(raw.data(), &number, sizeof number);
  bytes.append(raw.data(), raw.size());
}

void AppendTag(std::uint32_t type, std::uint64_t size, std::string& bytes) {
  AppendRaw(type, bytes);
  AppendRaw(static_cast<std::uint32_t>(size), bytes);
}

void Pad(std::string& bytes) { bytes.resize(PaddedSize(bytes.size()), '\0'); }

std::string FileHeader() {
  std::string header = "MATLAB 5.0 MAT-file, written by dlcs";
  header.resize(mat::kTextBytes, ' ');
  header.resize(mat::kHeaderBytes - 4, '\0');
  AppendRaw(mat::kVersion, header);
  AppendRaw(mat::kByteOrder, header);
  return header;
}

// Flags, shape and name of an array.
std::string ArrayHead(std::uint32_t array_class, std::size_t rows, std::size_t columns, std::string_view name) {
  std::string head;
  AppendTag(mat::kUint32, 8, head);
  AppendRaw(array_class, head);
  AppendRaw(std::uint32_t{0}, head);
  AppendTag(mat::kInt32, 8, head);
  AppendRaw(static_cast<std::int32_t>(rows), head);
  AppendRaw(static_cast<std::int32_t>(columns), head);
  AppendTag(mat::kInt8, name.size(), head);
  head += name;
  Pad(head);
  return head;
}

// `content`, the elements of an array, as an element.
std::string WrappedArray(const std::string& content) {
  std::string wrapped;
  AppendTag(mat::kMatrix, content.size(), wrapped);
  return wrapped + content;
}

// The code units of UTF-16. What is not UTF-8 in `text` becomes U+FFFD.
std::u16string Utf16(std::string_view text) {
  std::u16string units;
  for (std::size_t at = 0; at < text.size();) {
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[at + k]); };
    const unsigned char lead = byte(0);
    const std::size_t length = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if ((lead >= 0x80 && lead < 0xc0) || at + length > text.size()) {
      units += u'\ufffd';
      ++at;
      continue;
    }
    std::uint32_t letter = length == 1 ? lead : lead & (0x7fu >> length);
    for (std::size_t k = 1; k < length; ++k) letter = letter << 6 | (byte(k) & 0x3f);
    at += length;
    if (letter < 0x10000) {
      units += static_cast<char16_t>(letter);
    } else {
      units += static_cast<char16_t>(0xd800 + ((letter - 0x10000) >> 10));
      units += static_cast<char16_t>(0xdc00 + (letter & 0x3ff));
    }
  }
  return units;
}

std::string TextArray(std::string_view name, std::string_view text) {
  const std::u16string units = Utf16(text);
  std::string content = ArrayHead(mat::kCharClass, units.empty() ? 0 : 1, units.size(), name);
  AppendTag(mat::kUint16, 2 * units.size(), content);
  for (const char16_t unit : units) AppendRaw(unit, content);
  Pad(content);
  return WrappedArray(content);
}

std::string NamesArray(std::string_view name, const std::vector<std::string>& names) {
  std::string content = ArrayHead(mat::kCellClass, names.size(), 1, name);
  for (const std::string& one : names) content += TextArray("", one);
  return WrappedArray(content);
}

std::uint64_t BytesOf(const ResultArray& array) {
  return ArrayHead(mat::kDoubleClass, 0, 0, array.name).size() + 8 + array.values.size_bytes();
}

// Column by column, as MATLAB stores matrices.
void WriteMatArray(const ResultArray& array, std::FILE* out) {
  std::string begin;
  AppendTag(mat::kMatrix, BytesOf(array), begin);
  begin += ArrayHead(mat::kDoubleClass, array.rows, array.columns, array.name);
  AppendTag(mat::kDouble, array.values.size_bytes(), begin);
  std::fwrite(begin.data(), 1, begin.size(), out);
  for (std::size_t column = 0; column < array.columns && std::ferror(out) == 0; ++column) {
    for (std::size_t row = 0; row < array.rows; ++row) {
      std::fwrite(&array.values[row * array.columns + column], sizeof(double), 1, out);
    }
  }
}

}  // namespace

absl::Status WriteMat(const ResultArrays& all, std::FILE* out) {
  for (const ResultArray& array : all.arrays) {
    if (BytesOf(array) <= kMaxVariableBytes) continue;
    return absl::OutOfRangeError(
        fmt::format("{} of {} x {} numbers is too large for a MAT file, whose variables have less than 2 GB; write "
                    "HDF5, or fewer times with --at",
                    array.name, array.rows, array.columns));
  }
  const std::string header = FileHeader();
  std::fwrite(header.data(), 1, header.size(), out);
  for (const ResultArray& array : all.arrays) WriteMatArray(array, out);
  std::string texts;
  for (const auto& [name, names] : all.names) texts += NamesArray(name, names);
  texts += TextArray("summary", all.summary);
  std::fwrite(texts.data(), 1, texts.size(), out);
  return absl::OkStatus();  // errors of `out` are reported when it is flushed
}

}  // namespace dlcs::client
