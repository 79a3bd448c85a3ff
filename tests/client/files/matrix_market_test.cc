// SPDX-License-Identifier: Apache-2.0
#include "client/files/matrix_market.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::Matrix Parsed(const std::string& text) {
  const auto matrix = ParseMatrixMarket(text, "a.mtx");
  EXPECT_TRUE(matrix.ok()) << matrix.status();
  return matrix.ok() ? *matrix : v1::Matrix();
}

TEST(MatrixMarketTest, ReadsCoordinatesFromOne) {
  const v1::SparseMatrix sparse =
      Parsed("%%MatrixMarket matrix coordinate real general\n% a comment\n%\n\n3 4 2\n1 4 2.5\n3 1 -1e-3\n").sparse();
  EXPECT_EQ(sparse.rows(), 3);
  EXPECT_EQ(sparse.columns(), 4);
  EXPECT_THAT(sparse.row_indices(), ElementsAre(0, 2));
  EXPECT_THAT(sparse.column_indices(), ElementsAre(3, 0));
  EXPECT_THAT(sparse.values(), ElementsAre(2.5, -1e-3));
}

TEST(MatrixMarketTest, MirrorsTheTriangleOfASymmetricMatrix) {
  const v1::SparseMatrix sparse =
      Parsed("%%MatrixMarket matrix coordinate integer symmetric\r\n2 2 2\r\n1 1 4\r\n2 1 -1\r\n").sparse();
  EXPECT_THAT(sparse.row_indices(), ElementsAre(0, 1, 0));
  EXPECT_THAT(sparse.column_indices(), ElementsAre(0, 0, 1));
  EXPECT_THAT(sparse.values(), ElementsAre(4, -1, -1));
}

TEST(MatrixMarketTest, ChangesTheSignInASkewMatrix) {
  EXPECT_THAT(Parsed("%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 3\n").sparse().values(),
              ElementsAre(3, -3));
  EXPECT_THAT(Parsed("%%MatrixMarket matrix array real skew-symmetric\n3 3\n1\n2\n3\n").dense().values(),
              ElementsAre(0, -1, -2, 1, 0, -3, 2, 3, 0));
}

TEST(MatrixMarketTest, TakesAPatternAsOnes) {
  EXPECT_THAT(Parsed("%%matrixmarket MATRIX Coordinate Pattern General\n1 2 2\n1 1\n1 2\n").sparse().values(),
              ElementsAre(1, 1));
}

TEST(MatrixMarketTest, ReadsAnArrayColumnByColumn) {
  const v1::DenseMatrix dense = Parsed("%%MatrixMarket matrix array real general\n2 3\n1\n2\n+3\n4\n5\n6").dense();
  EXPECT_THAT(dense.values(), ElementsAre(1, 3, 5, 2, 4, 6));
  EXPECT_THAT(Parsed("%%MatrixMarket matrix array real symmetric\n2 2\n1\n2\n3\n").dense().values(),
              ElementsAre(1, 2, 2, 3));
}

TEST(MatrixMarketTest, ReadsSomeOfTheLinesOfAFile) {
  const std::string file = "%%MatrixMarket matrix coordinate pattern symmetric\n% a comment\n3 3 4000000000\n1 1\n";
  const auto head = ParseMarketHead(file, "a.mtx");
  ASSERT_TRUE(head.ok()) << head.status();
  EXPECT_EQ(head->rows, 3);
  EXPECT_EQ(head->entries, 4'000'000'000);  // more than 32 bits count
  EXPECT_EQ(file.substr(head->bytes), "\n1 1\n");
  EXPECT_EQ(head->line, 3);

  std::vector<std::tuple<int, int, double>> entries;
  const auto add = [&](int row, int column, double value) { entries.emplace_back(row, column, value); };
  const auto count = ParseMarketLines("% 9 9\n2 1\n\n3 3\n", 700, *head, "a.mtx", add);
  ASSERT_TRUE(count.ok()) << count.status();
  EXPECT_EQ(*count, 2);
  EXPECT_THAT(entries, ElementsAre(std::tuple(1, 0, 1.0), std::tuple(0, 1, 1.0), std::tuple(2, 2, 1.0)));

  const auto broken = ParseMarketLines("2 1\n3 4\n", 700, *head, "a.mtx", add);
  EXPECT_THAT(std::string(broken.status().message()), HasSubstr("a.mtx, line 701: 4, the column of an entry"));
  const auto split = ParseMarketLines("2\n1\n", 700, *head, "a.mtx", add);
  EXPECT_THAT(std::string(split.status().message()), HasSubstr("line 700: each entry must have a line of its own"));
}

TEST(MatrixMarketTest, SkipsAByteOrderMark) {
  const std::string file = "\xef\xbb\xbf%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 4\n";
  EXPECT_THAT(Parsed(file).sparse().values(), ElementsAre(4));
  const auto head = ParseMarketHead(file, "a.mtx");
  ASSERT_TRUE(head.ok()) << head.status();
  EXPECT_EQ(file.substr(head->bytes), "\n1 1 4\n");
}

TEST(MatrixMarketTest, ReadsTheExponentsOfFortran) {
  const std::string file = "%%MatrixMarket matrix array real general\n4 1\n";
  EXPECT_THAT(Parsed(file + "-1.0D0\n2.5d+01\n+1D-2\n1.5E2\n").dense().values(), ElementsAre(-1, 25, 0.01, 150));
  for (const char* value : {"1D", "1D+", "1DD2", "D2", "1D400", "1D2x"}) {
    const auto matrix = ParseMatrixMarket(file + value + "\n1\n1\n1\n", "a.mtx");
    EXPECT_THAT(std::string(matrix.status().message()), HasSubstr("a.mtx, line 3: \"" + std::string(value) + "\""));
  }
}

TEST(MatrixMarketTest, NamesTheLineAndWhatIsWrong) {
  const std::string coordinate = "%%MatrixMarket matrix coordinate real general\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "line 1: must be \"%%MatrixMarket"},
      {"1 2 3\n", "line 1: must be \"%%MatrixMarket"},
      {"%%MatrixMarket matrix coordinate complex general\n", "line 1: the field is \"complex\""},
      {"%%MatrixMarket matrix coordinate real hermitian\n", "line 1: the symmetry is \"hermitian\""},
      {"%%MatrixMarket matrix array pattern general\n", "line 1: a pattern"},
      {coordinate, "the file ends where the number of rows is expected"},
      {coordinate + "0 2 1\n", "line 2: 0, the number of rows; must be from 1"},
      {coordinate + "2 3000000000 1\n", "must be from 1 to 2147483647"},
      {coordinate + "2 2 -1\n", "line 2: -1 entries"},
      {coordinate + "2 2 1\n% note\n3 1 5\n", "line 4: 3, the row of an entry; must be from 1 to 2"},
      {coordinate + "2 2 1\n1 0 5\n", "line 3: 0, the column of an entry"},
      {coordinate + "2 2 1\n1 1 x\n", "line 3: \"x\" where a value is expected"},
      {coordinate + "2 2 1\n1 1 nan\n", "every value must be finite"},
      {coordinate + "2 2 1\n1.5 1 1\n", "\"1.5\" where the row of an entry is expected"},
      {coordinate + "2 2 2\n1 1 1\n", "the file ends where the row of an entry is expected"},
      {coordinate + "2 2 1\n1 1 1\n2 2 2\n", "line 4: \"2\" follows the last entry"},
      {"%%MatrixMarket matrix coordinate real symmetric\n2 3 0\n", "must be square"},
      {"%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n1 1 5\n", "on its diagonal"},
      {"%%MatrixMarket matrix array real general\n2000000000 2000000000\n", "this file does not have"},
  };
  for (const auto& [text, rule] : cases) {
    const auto matrix = ParseMatrixMarket(text, "a.mtx");
    ASSERT_FALSE(matrix.ok()) << text;
    EXPECT_THAT(std::string(matrix.status().message()), HasSubstr(rule)) << text;
    EXPECT_THAT(std::string(matrix.status().message()), HasSubstr("a.mtx, line ")) << text;
  }
}

}  // namespace
}  // namespace dlcs::client
