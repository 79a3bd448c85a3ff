// SPDX-License-Identifier: Apache-2.0
#include "client/files/npy_array.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// An .npy file of version `major` with this header and these elements.
std::string NpyText(const std::string& header, const std::string& elements, char major = 1) {
  std::string text = std::string(kNpyMagic) + major + '\0';
  const std::size_t length_bytes = major == 1 ? 2 : 4;
  for (std::size_t k = 0; k < length_bytes; ++k) text += static_cast<char>(header.size() >> 8 * k & 0xff);
  return text + header + elements;
}

std::string NpyDict(const std::string& type, const std::string& shape, const std::string& fortran = "False") {
  return "{'descr': '" + type + "', 'fortran_order': " + fortran + ", 'shape': " + shape + ", }\n";
}

absl::StatusOr<StoredArray> NpyOf(const std::string& text) {
  ReadingBudget budget;
  return ParseNpy(text, budget);
}

v1::DenseMatrix NpyMatrix(const std::string& text) {
  const auto array = NpyOf(text);
  EXPECT_TRUE(array.ok()) << array.status();
  return array.ok() ? array->matrix.dense() : v1::DenseMatrix();
}

std::string NpyRefusal(const std::string& text) {
  const auto array = NpyOf(text);
  EXPECT_FALSE(array.ok());
  return std::string(array.status().message());
}

// The bytes of an integer, the first one first.
std::string LittleBytes(std::uint64_t bits, std::size_t size) {
  std::string bytes;
  for (std::size_t k = 0; k < size; ++k) bytes += static_cast<char>(bits >> 8 * k & 0xff);
  return bytes;
}

std::string Reversed(std::string bytes) { return {bytes.rbegin(), bytes.rend()}; }

TEST(NpyArrayTest, ReadsBothOrdersOfStorage) {
  std::string elements;
  for (int k = 1; k <= 6; ++k) elements += static_cast<char>(k);
  EXPECT_THAT(NpyMatrix(NpyText(NpyDict("|i1", "(2, 3)"), elements)).values(), ElementsAre(1, 2, 3, 4, 5, 6));
  const v1::DenseMatrix by_columns = NpyMatrix(NpyText(NpyDict("|i1", "(2, 3)", "True"), elements));
  EXPECT_EQ(by_columns.rows(), 2);
  EXPECT_EQ(by_columns.columns(), 3);
  EXPECT_THAT(by_columns.values(), ElementsAre(1, 3, 5, 2, 4, 6));
}

TEST(NpyArrayTest, ReadsEveryKindOfNumberInBothOrdersOfBytes) {
  const auto bits_of_float = [](float value) { return std::uint64_t{std::bit_cast<std::uint32_t>(value)}; };
  struct Case {
    std::string type;
    std::uint64_t bits;
    double value;
  };
  for (const Case& one : std::vector<Case>{{"i1", 0xff, -1},
                                           {"i2", 0x8000, -32768},
                                           {"i4", 0xfffffffe, -2},
                                           {"i8", 0x8000000000000000, -9223372036854775808.0},
                                           {"u1", 0xff, 255},
                                           {"u2", 0xffff, 65535},
                                           {"u4", 0xffffffff, 4294967295.0},
                                           {"u8", std::uint64_t{1} << 63, 9223372036854775808.0},
                                           {"b1", 1, 1},
                                           {"f2", 0x3555, 0.333251953125},
                                           {"f2", 0x0001, 5.9604644775390625e-8},
                                           {"f2", 0xc000, -2},
                                           {"f4", bits_of_float(0.1f), 0.1f},
                                           {"f8", std::bit_cast<std::uint64_t>(0.1), 0.1},
                                           {"f8", 1, 5e-324}}) {
    SCOPED_TRACE(one.type);
    const std::string bytes = LittleBytes(one.bits, static_cast<std::size_t>(one.type[1] - '0'));
    EXPECT_THAT(NpyMatrix(NpyText(NpyDict("<" + one.type, "()"), bytes)).values(), ElementsAre(one.value));
    EXPECT_THAT(NpyMatrix(NpyText(NpyDict(">" + one.type, "(1,)"), Reversed(bytes))).values(), ElementsAre(one.value));
  }
}

TEST(NpyArrayTest, KnowsListsAndNumbers) {
  EXPECT_EQ(NpyOf(NpyText(NpyDict("|u1", "()"), "\1"))->dimensions, 0);
  EXPECT_EQ(NpyOf(NpyText(NpyDict("|u1", "(2L,)"), "\1\2", 2))->dimensions, 1);
  EXPECT_EQ(NpyOf(NpyText(NpyDict("|u1", "(1, 2)"), "\1\2", 3))->dimensions, 2);
}

TEST(NpyArrayTest, ReadsWhatItWrites) {
  for (const std::vector<std::size_t>& shape : std::vector<std::vector<std::size_t>>{{}, {2}, {2, 1}, {1, 2}}) {
    const std::array<double, 2> values = {0.1, -5e-324};
    std::string text = NpyHeader("f8", shape);
    EXPECT_EQ(text.size() % 64, 0u);
    text.append(reinterpret_cast<const char*>(values.data()), shape.empty() ? 8 : 16);
    const v1::DenseMatrix matrix = NpyMatrix(text);
    ASSERT_EQ(matrix.values_size(), shape.empty() ? 1 : 2);
    EXPECT_EQ(std::memcmp(matrix.values().data(), values.data(), shape.empty() ? 8 : 16), 0);
  }
}

TEST(NpyArrayTest, SaysWhatItDoesNotRead) {
  const std::string eight(8, '\0');
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "is not a NumPy array"},
      {std::string(kNpyMagic), "is not a NumPy array"},
      {NpyText("", "", 9), "is of version 9"},
      {std::string(kNpyMagic) + std::string("\1\0", 2), "ends in its header"},
      {NpyText(NpyDict("<f8", "(1,)"), eight).substr(0, 30), "ends in its header"},
      {NpyText(std::string(20'000, ' '), ""), "header of 20000 bytes; must have at most 10000"},
      {NpyText("not a dictionary", ""), "damaged header"},
      {NpyText("{'descr': '<f8', 'shape': (1,)}", eight), "damaged header"},
      {NpyText("{'descr': '<f8', 'fortran_order': 1, 'shape': (1,)}", eight), "damaged header"},
      {NpyText("{'descr': '<f8', 'descr': '<f8', 'fortran_order': True, 'shape': (1,)}", eight), "damaged header"},
      {NpyText(NpyDict("<f8", "(-1,)"), eight), "damaged header"},
      {NpyText(NpyDict("<f8", "(99999999999999999999,)"), eight), "damaged header"},
      {NpyText("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,)}", eight), "records with fields"},
      {NpyText(NpyDict("|O", "(1,)"), eight), "holds Python objects (pickled) of the type \"|O\""},
      {NpyText(NpyDict("|O8", "(1,)"), eight), "holds Python objects (pickled)"},
      {NpyText(NpyDict("<c16", "(1,)"), eight + eight), "holds complex numbers of the type \"<c16\""},
      {NpyText(NpyDict("<U2", "(1,)"), eight), "holds text"},
      {NpyText(NpyDict("<M8[s]", "(1,)"), eight), "holds dates or times"},
      {NpyText(NpyDict("<f16", "(1,)"), eight + eight), "floats of at most 64 bits"},
      {NpyText(NpyDict("<i3", "(1,)"), eight), "at most 64 bits"},
      {NpyText(NpyDict("f8", "(1,)"), eight), "at most 64 bits"},
      {NpyText(NpyDict("<f8", "(1, 1, 1)"), eight), "has 3 dimensions; must have at most two"},
      {NpyText(NpyDict("<f8", "(0, 3)"), ""), "is empty (0 x 3)"},
      {NpyText(NpyDict("<f8", "(2,)"), eight), "has 8 bytes; 2 x 1 numbers must have 16"},
      {NpyText(NpyDict("<f8", "(1,)"), eight + "x"), "has 9 bytes"},
      {NpyText(NpyDict("<f8", "(4294967296, 4294967296)"), eight), "must have at most 33554432"},
      {NpyText(NpyDict("<f8", "(18446744073709551615, 2)"), eight), "must have at most 33554432"},
      {NpyText(NpyDict("<f8", "(1, 1)"), std::string("\0\0\0\0\0\0\xf0\x7f", 8)), "row 0, column 0 (from 0) inf"},
      {NpyText(NpyDict("<i8", "(1,)"), std::string("\1\0\0\0\0\0\x20\0", 8)), "an integer of more than 53 bits"},
  };
  for (const auto& [text, words] : cases) EXPECT_THAT(NpyRefusal(text), HasSubstr(words));
}

}  // namespace
}  // namespace dlcs::client
