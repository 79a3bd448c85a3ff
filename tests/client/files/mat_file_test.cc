// SPDX-License-Identifier: Apache-2.0
// Files that no other program makes; tests/client/array_files_test.py reads those of SciPy.
#include "client/files/mat_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string MatWords(const std::vector<std::uint32_t>& words) {
  std::string bytes;
  for (const std::uint32_t word : words) {
    for (int k = 0; k < 4; ++k) bytes += static_cast<char>(word >> 8 * k & 0xff);
  }
  return bytes;
}

std::string MatElementOf(std::uint32_t type, std::string data) {
  const auto size = static_cast<std::uint32_t>(data.size());
  data.resize((data.size() + 7) / 8 * 8, '\0');
  return MatWords({type, size}) + data;
}

std::string MatHeader(const std::string& order = "IM") {
  std::string header = "MATLAB 5.0 MAT-file";
  header.resize(124, ' ');
  return header + std::string("\0\1", 2) + order;
}

// The array A with these flags and this shape, and `values`, its last elements.
std::string MatArray(std::uint32_t flags, const std::vector<std::uint32_t>& shape, const std::string& values) {
  return MatElementOf(mat::kMatrix, MatElementOf(mat::kUint32, MatWords({flags, 0})) +
                                        MatElementOf(mat::kInt32, MatWords(shape)) + MatElementOf(mat::kInt8, "A") +
                                        values);
}

absl::StatusOr<StoredVariables> MatVariables(const std::string& text) {
  ReadingBudget budget;
  return ParseMat(
      text, [](const std::string&) { return true; }, budget);
}

absl::StatusOr<StoredArray> MatArrayIn(const std::string& elements) {
  auto variables = MatVariables(MatHeader() + elements);
  if (!variables.ok()) return variables.status();
  return variables->arrays.at("A");
}

std::string MatRefusalOf(const std::string& elements) {
  const auto array = MatArrayIn(elements);
  EXPECT_FALSE(array.ok());
  return std::string(array.status().message());
}

// Three entries of 3 x 2: (2, 0), (0, 1), (1, 1).
std::string SparseParts(const std::vector<std::uint32_t>& rows, const std::vector<std::uint32_t>& begins,
                        const std::string& values) {
  return MatElementOf(mat::kInt32, MatWords(rows)) + MatElementOf(mat::kInt32, MatWords(begins)) +
         MatElementOf(mat::kUint8, values);
}

TEST(MatFileTest, ReadsColumnsAsTheyAreStored) {
  const auto array = MatArrayIn(MatArray(mat::kDoubleClass, {2, 3}, MatElementOf(mat::kInt8, "\1\2\3\4\5\xff")));
  ASSERT_TRUE(array.ok()) << array.status();
  EXPECT_THAT(array->matrix.dense().values(), ElementsAre(1, 3, 5, 2, 4, -1));
}

TEST(MatFileTest, ReadsSmallElementsAndShortPadding) {
  // Four bytes or less share the tag.
  const std::string small = MatWords({2 << 16 | mat::kUint8}) + std::string("\7\x8\0\0", 4);
  const auto array = MatArrayIn(MatArray(mat::kDoubleClass, {1, 2}, small));
  ASSERT_TRUE(array.ok()) << array.status();
  EXPECT_THAT(array->matrix.dense().values(), ElementsAre(7, 8));
}

TEST(MatFileTest, ReadsSparseArrays) {
  const auto array = MatArrayIn(MatArray(mat::kSparseClass, {3, 2}, SparseParts({2, 0, 1, 9}, {0, 1, 3}, "\5\6\7")));
  ASSERT_TRUE(array.ok()) << array.status();
  const v1::SparseMatrix& sparse = array->matrix.sparse();
  EXPECT_EQ(sparse.rows(), 3);
  EXPECT_EQ(sparse.columns(), 2);
  EXPECT_THAT(sparse.row_indices(), ElementsAre(2, 0, 1));
  EXPECT_THAT(sparse.column_indices(), ElementsAre(0, 1, 1));
  EXPECT_THAT(sparse.values(), ElementsAre(5, 6, 7));
}

TEST(MatFileTest, ReadsOnlyWhatIsWanted) {
  ReadingBudget budget(8);
  const std::string text = MatHeader() + MatArray(mat::kDoubleClass, {1, 2}, MatElementOf(mat::kUint8, "\1\2"));
  const auto none = ParseMat(
      text, [](const std::string&) { return false; }, budget);
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_THAT(none->names, ElementsAre("A"));
  EXPECT_TRUE(none->arrays.empty());
  const auto all = ParseMat(
      text, [](const std::string&) { return true; }, budget);
  EXPECT_EQ(all->arrays.at("A").status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(MatFileTest, SaysWhatIsWrong) {
  const std::string value = MatElementOf(mat::kUint8, "\1");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {MatArray(mat::kStructClass, {1, 1}, value), "is a structure; must be an array of numbers"},
      {MatArray(mat::kFunctionClass, {1, 1}, value), "is a function"},
      {MatArray(mat::kOpaqueClass, {1, 1}, value), "is an object of a class"},
      {MatArray(99, {1, 1}, value), "is of an unknown class"},
      {MatArray(mat::kDoubleClass | mat::kComplexFlag, {1, 1}, value), "holds complex numbers"},
      {MatArray(mat::kDoubleClass, {1, 1, 1}, value), "has 3 dimensions; must have two"},
      {MatArray(mat::kDoubleClass, {1, 2}, value), "has 1 bytes; 1 x 2 numbers must have 2"},
      {MatArray(mat::kDoubleClass, {0xffffffff, 2}, value), "must have at most 33554432"},
      {MatArray(mat::kDoubleClass, {1, 1}, ""), "ends in the middle of an element"},
      {MatArray(mat::kDoubleClass, {1, 1}, MatElementOf(77, "x")), "its values are not numbers"},
      {MatArray(mat::kDoubleClass, {1, 1}, MatElementOf(mat::kDouble, "x")), "its values are not numbers"},
      {MatArray(mat::kDoubleClass, {1, 1}, MatWords({5 << 16 | mat::kUint8, 0})), "has a wrong tag"},
      {MatArray(mat::kSparseClass, {0, 2}, value), "is of 0 x 2; must have from 1"},
      {MatArray(mat::kSparseClass, {3, 2}, SparseParts({0}, {0, 1}, "\1")), "do not fit"},
      {MatArray(mat::kSparseClass, {3, 2}, SparseParts({0}, {1, 1, 1}, "\1")), "do not fit"},
      {MatArray(mat::kSparseClass, {3, 2}, SparseParts({0}, {0, 2, 1}, "\1")), "do not fit"},
      {MatArray(mat::kSparseClass, {3, 2}, SparseParts({3}, {0, 1, 1}, "\1")), "do not fit"},
      {MatArray(mat::kSparseClass, {3, 2}, SparseParts({0}, {0, 0, 9}, "\1")), "do not fit"},
      {MatArray(mat::kSparseClass, {3, 2}, SparseParts({0, 1}, {0, 1, 2}, "\1")), "do not fit"},
      {MatArray(mat::kSparseClass, {3, 2}, value + value + value), "indices are not integers of 32 bits"},
      {"abc", "ends in the middle of an element"},
      {MatElementOf(mat::kInt8, "A"), "an element is of the type 1"},
      {MatElementOf(mat::kMatrix, value), "an array has no flags"},
      {MatElementOf(mat::kCompressed, "not packed"), "cannot be unpacked"},
      // A packed element whose size is said to share the tag.
      {MatWords({4 << 16 | mat::kCompressed, 0}), "cannot be unpacked"},
      {MatArray(mat::kDoubleClass, {1, 1}, value) + MatArray(mat::kDoubleClass, {1, 1}, value), "holds \"A\" twice"},
  };
  for (const auto& [elements, words] : cases) EXPECT_THAT(MatRefusalOf(elements), HasSubstr(words));
  EXPECT_THAT(std::string(MatVariables(MatHeader("??")).status().message()), HasSubstr("the order of bytes"));
  EXPECT_THAT(std::string(MatVariables("MATLAB 5.0 MAT-file").status().message()), HasSubstr("ends in its header"));
}

}  // namespace
}  // namespace dlcs::client
