// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/state_archive.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace dlcs {
namespace {

template <typename... Values>
std::string Written(Values... values) {
  StateArchive archive;
  archive(values...);
  return archive.Take();
}

TEST(StateArchiveTest, ReadsWhatWasWritten) {
  const Matrix matrix = Matrix::Constant(2, 3, 0.1);
  const std::string bytes =
      Written(matrix, std::vector<Index>{1, 2}, std::string("text"), std::optional<double>(0.5), true);
  StateArchive archive(bytes);
  Matrix read;
  std::vector<Index> list;
  std::string text;
  std::optional<double> number;
  bool flag = false;
  archive(read, list, text, number, flag);
  EXPECT_TRUE(archive.at_end());
  EXPECT_EQ(read, matrix);
  EXPECT_EQ(list, (std::vector<Index>{1, 2}));
  EXPECT_EQ(text, "text");
  EXPECT_EQ(number, 0.5);
  EXPECT_TRUE(flag);
}

TEST(StateArchiveTest, ReadsMatricesWithoutEntriesAtTheEnd) {
  const std::string bytes = Written(Matrix(100, 0), Matrix(0, 100));
  StateArchive archive(bytes);
  Matrix tall, wide;
  archive(tall, wide);
  EXPECT_TRUE(archive.at_end());
  EXPECT_EQ(tall.rows(), 100);
  EXPECT_EQ(wide.cols(), 100);
}

TEST(StateArchiveTest, RefusesMatricesThatCannotBeThere) {
  const Index huge = Index{1} << 61;
  for (const auto& [rows, columns] :
       std::vector<std::pair<Index, Index>>{{huge, 8}, {8, huge}, {-1, 0}, {0, -1}, {2, 2}}) {
    const std::string bytes = Written(rows, columns, 1.0, 2.0, 3.0);
    StateArchive archive(bytes);
    Matrix matrix;
    archive(matrix);
    EXPECT_FALSE(archive.ok()) << rows << " x " << columns;
    EXPECT_EQ(matrix.size(), 0);
  }
}

TEST(StateArchiveTest, ReadsNothingThatWasChangedOrCut) {
  const std::string bytes = Written(Index{7}, std::string("seven"));
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    std::string changed = bytes;
    changed[k] ^= 4;
    EXPECT_FALSE(StateArchive(changed).ok()) << k;
    EXPECT_FALSE(StateArchive(bytes.substr(0, k)).ok()) << k;
  }
}

}  // namespace
}  // namespace dlcs
