// SPDX-License-Identifier: Apache-2.0
#include "client/files/matrix_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/files/problem_file.h"
#include "google/protobuf/util/message_differencer.h"

namespace dlcs::client {
namespace {

using ::google::protobuf::util::MessageDifferencer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

std::optional<v1::Matrix> Read(const std::string& text, std::string& error, const std::string& source = "p.json") {
  JsonReader reader(source);
  auto matrix = ReadAnyMatrix(nlohmann::json::parse(text), "A", reader);
  error = std::string(reader.status().message());
  return matrix;
}

v1::Matrix Sound(const std::string& text) {
  std::string error;
  const auto matrix = Read(text, error);
  EXPECT_TRUE(matrix.has_value()) << text << "\n" << error;
  return matrix.value_or(v1::Matrix());
}

std::vector<std::tuple<int, int, double>> EntriesOf(const v1::SparseMatrix& sparse) {
  std::vector<std::tuple<int, int, double>> entries;
  for (int k = 0; k < sparse.values_size(); ++k) {
    entries.emplace_back(sparse.row_indices(k), sparse.column_indices(k), sparse.values(k));
  }
  return entries;
}

using Entry = std::tuple<int, int, double>;

TEST(MatrixJsonTest, ReadsEntriesInBothForms) {
  const v1::Matrix entries = Sound(R"({"rows": 2, "columns": 3, "entries": [[0, 2, 1.5], [1, 0, -2]]})");
  EXPECT_THAT(EntriesOf(entries.sparse()), ElementsAre(Entry{0, 2, 1.5}, Entry{1, 0, -2}));
  EXPECT_EQ(entries.sparse().columns(), 3);
  const v1::Matrix values =
      Sound(R"({"rows": 2, "columns": 3, "row_indices": [0, 1], "column_indices": [2, 0], "values": [1.5, -2]})");
  EXPECT_TRUE(MessageDifferencer::Equals(entries, values));
}

TEST(MatrixJsonTest, FillsDiagonals) {
  const v1::Matrix square = Sound(R"({"rows": 3, "diagonals": {"0": 4, "1": -1, "-2": [7]}})");
  EXPECT_THAT(EntriesOf(square.sparse()), UnorderedElementsAre(Entry{0, 0, 4}, Entry{1, 1, 4}, Entry{2, 2, 4},
                                                               Entry{0, 1, -1}, Entry{1, 2, -1}, Entry{2, 0, 7}));
  const v1::Matrix wide = Sound(R"({"rows": 2, "columns": 3, "diagonals": {"1": [5, 6]}})");
  EXPECT_THAT(EntriesOf(wide.sparse()), ElementsAre(Entry{0, 1, 5}, Entry{1, 2, 6}));
}

TEST(MatrixJsonTest, ReadsKroneckerSums) {
  const v1::Matrix sum = Sound(R"({"kronecker_sum": [[[1, 2], [3, 4]], {"rows": 3, "diagonals": {"0": -2}}]})");
  ASSERT_EQ(sum.kronecker_sum().factors_size(), 2);
  EXPECT_EQ(sum.kronecker_sum().factors(0).dense().rows(), 2);
  EXPECT_EQ(sum.kronecker_sum().factors(1).sparse().values_size(), 3);
}

TEST(MatrixJsonTest, NamesPlaceValueAndRule) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"7", "A is a number (7); must be a list of rows, or an object with entries"},
      {"{}", "A is an object; must be a list of rows"},
      {R"({"entries": []})", "\"rows\" is missing"},
      {R"({"rows": 0, "columns": 1, "entries": []})", "A.rows is a number (0); must be a whole number from 1"},
      {R"({"rows": 2.5, "columns": 1, "entries": []})", "A.rows is a number (2.5); must be a whole"},
      {R"({"rows": 2, "columns": 2, "entries": [[0, 0]]})", "A.entries[0] is a list (of 2)"},
      {R"({"rows": 2, "columns": 2, "entries": [[0, 2, 1]]})",
       "A.entries[0][1] is a number (2); must be a whole number from 0 to 1"},
      {R"({"rows": 2, "columns": 2, "entries": [[-1, 0, 1]]})", "A.entries[0][0] is a number (-1)"},
      {R"({"rows": 2, "columns": 2, "entries": [[0, 0, "1"]]})", "A.entries[0][2] is a string"},
      {R"({"rows": 2, "columns": 2, "entries": [], "shape": 1})", "\"shape\" is not a known key in A"},
      {R"({"rows": 2, "columns": 2, "row_indices": [0], "column_indices": [0], "values": [1, 2]})",
       "must have as many of each"},
      {R"({"rows": 2, "columns": 2, "row_indices": [5], "column_indices": [0], "values": [1]})",
       "A.row_indices[0] is a number (5)"},
      {R"({"rows": 2, "diagonals": {"up": 1}})", "\"up\" is not a diagonal"},
      {R"({"rows": 2, "diagonals": {"2": 1}})", "lies outside the 2 x 2 matrix"},
      {R"({"rows": 3, "diagonals": {"1": [1, 2, 3]}})", "has 3 values; must have 2, or be one number"},
      {R"({"rows": 2000000000, "diagonals": {"0": 1}})", "makes more than"},
      {R"({"kronecker_sum": []})", "A.kronecker_sum is an empty list"},
      {R"({"kronecker_sum": [[[1]], {"rows": 1}]})", "A.kronecker_sum[1] is an object"},
      {R"({"kronecker_sum": [{"kronecker_sum": [[[1]]]}]})", "name all factors in one list"},
      {R"({"matrix_market": "nowhere.mtx"})", "A.matrix_market cannot be read: nowhere.mtx: there is no such file"},
  };
  for (const auto& [text, rule] : cases) {
    std::string error;
    Read(text, error);  // the result does not matter: the reader has recorded an error
    EXPECT_THAT(error, HasSubstr(rule)) << text;
  }
}

// A folder with a problem and the matrices that it names.
class MatrixFilesTest : public ::testing::Test {
 protected:
  MatrixFilesTest() { std::filesystem::create_directories(folder_); }
  ~MatrixFilesTest() override { std::filesystem::remove_all(folder_); }

  void Write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) /
      (std::string("matrix_files_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(MatrixFilesTest, AreFoundBesideTheProblem) {
  Write("a.mtx", "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 -1\n2 2 -2\n");
  Write("x0.mtx", "%%MatrixMarket matrix array real general\n2 1\n3\n4\n");
  Write("p.json", R"({"A": {"matrix_market": "a.mtx"}, "B": [[1], [0]], "N": [[1, 0]], "M": [[1]],
                      "x0": {"matrix_market": "x0.mtx"}, "T": 1})");
  const auto file = ReadProblemFile((folder_ / "p.json").string());
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->problem.a().sparse().values_size(), 2);
  EXPECT_THAT(file->problem.x0(), ElementsAre(3, 4));
  EXPECT_EQ(file->problem.f().pieces(0).constant().values_size(), 2);
}

TEST_F(MatrixFilesTest, AreNamedWithTheirLineWhereTheyAreWrong) {
  Write("a.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 1\n3 1 -1\n");
  Write("p.json",
        R"({"A": {"matrix_market": "a.mtx"}, "B": [[1], [0]], "N": [[1, 0]], "M": [[1]], "x0": [1, 2], "T": 1})");
  const auto file = ReadProblemFile((folder_ / "p.json").string());
  ASSERT_FALSE(file.ok());
  EXPECT_THAT(std::string(file.status().message()), HasSubstr("a.mtx, line 3: 3, the row of an entry"));
}

TEST(ProblemJsonTest, KeepsStructureSourcesAndRule) {
  const std::string text = R"json({
    "A": {"kronecker_sum": [{"rows": 2, "diagonals": {"0": -2, "1": 1}}, [[-1]]]},
    "B": {"rows": 2, "columns": 1, "entries": [[1, 0, 3]]}, "N": [[1, 0]], "M": [[2]],
    "f": {"matrix": [[1], [2]], "pieces": [{"t0": 0, "of": ["sin(t)"]}, {"t0": 0.5, "of": [1]}]},
    "g": {"times": [0, 1], "values": [[1], [2]]},
    "x0": [1, 2], "T": 1.5, "break_points": [0.25], "rule": "minimizer", "selector": {"C": [[1]], "b": [0]}})json";
  const auto file = ParseProblem(text, "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->problem.f().lift().dense().columns(), 1);
  EXPECT_EQ(file->problem.f().pieces(1).start(), 0.5);
  const auto again = ParseProblem(ProblemJson(file->problem).dump(), "q.json");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(MessageDifferencer::Equals(again->problem, file->problem)) << ProblemJson(file->problem).dump(1);
}

TEST(ProblemJsonTest, LiftedSourcesHaveAComponentForEachColumn) {
  const std::string start = R"({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0], "T": 1, "f": )";
  const auto wrong = ParseProblem(start + R"({"matrix": [[1, 2]], "of": {"times": [0], "values": [[1]]}}})", "p.json");
  ASSERT_FALSE(wrong.ok());
  EXPECT_THAT(std::string(wrong.status().message()), HasSubstr("f.of.values has rows of 1"));
  const auto missing = ParseProblem(start + R"({"matrix": [[1]]}})", "p.json");
  EXPECT_THAT(std::string(missing.status().message()), HasSubstr("\"of\" is missing"));
  const auto unknown = ParseProblem(start + R"({"matrix": [[1]], "off": ["t"]}})", "p.json");
  EXPECT_THAT(std::string(unknown.status().message()), HasSubstr("did you mean \"of\""));
}

}  // namespace
}  // namespace dlcs::client
