// SPDX-License-Identifier: Apache-2.0
// Malicious problem files, given to the built `dlcs`: each is refused as bad input, with a short message, quickly, and
// without more memory than its own bytes need while they are read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "tests/client/cli/program.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using dlcs::testing::QuotedExample;
using ::testing::HasSubstr;

constexpr std::int64_t kFileBytes = 45'000'000;
constexpr std::size_t kPartsOfBlock = 10'000;  // written at once
// Beside the file: the program, its libraries and this process.
constexpr std::int64_t kOtherBytes = 100'000'000;

class HostileFileTest : public ::testing::Test {
 protected:
  // A file of `begin`, repetitions of `part` up to `bytes`, and `end`. It is never in the memory of this process as a
  // whole.
  std::string File(const std::string& begin, const std::string& part, std::int64_t bytes, const std::string& end) {
    std::ofstream file(path_, std::ios::trunc);
    file << begin;
    const std::size_t size = part.size();
    std::size_t left = (static_cast<std::size_t>(bytes) + size - 1) / size;
    std::string block;
    for (std::size_t k = std::min(left, kPartsOfBlock); k > 0; --k) block += part;
    for (; left >= kPartsOfBlock; left -= kPartsOfBlock) file << block;
    file << block.substr(0, left * size);
    file << end;
    return path_;
  }

  // At most `times` the file's bytes in memory.
  void ExpectRefused(const std::string& command, const std::string& words, std::int64_t times) {
    SCOPED_TRACE(command);
    const ProgramOutcome outcome = RunDlcs(command);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_LT(outcome.err.size(), 10'000u);
    if (dlcs::testing::kSlowness == 1) {  // sanitizers take memory of their own
      EXPECT_LT(outcome.peak_bytes, times * kFileBytes + kOtherBytes);
    }
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string path_ = folder_.File("problem.json");
};

TEST_F(HostileFileTest, NestedJsonOfManyMegabytes) {
  // While text grows it is there twice, at most.
  const std::string deep = "nested deeper than 32";
  const std::string file = File("", "[", kFileBytes, "");
  const std::vector<std::string> commands = {"solve ",
                                             "analyze ",
                                             "submit ",
                                             "upload ",
                                             "lcp ",
                                             "dcp ",
                                             "model input-output ",
                                             "ensemble " + QuotedExample("rectifier") + " ",
                                             "solve - < "};
  for (const std::string& command : commands) {
    ExpectRefused(command + file, deep, 2);
  }
  ExpectRefused("solve " + File("", R"({"A":)", kFileBytes, ""), deep, 2);
  ExpectRefused("solve " + File(R"({"T": 1, "A": )", "[", kFileBytes, ""), deep, 2);
  ExpectRefused("solve " + File(R"({"f": [)", R"({"a":[)", kFileBytes, ""), deep, 2);
}

// No deeper than is allowed: a hundred bytes of memory and more for two of the file.
TEST_F(HostileFileTest, ManySmallListsAndObjects) {
  if (dlcs::testing::kSlowness > 1) GTEST_SKIP() << "sanitizers take many gigabytes for as many lists";
  const std::string nest = std::string(29, '[') + std::string(29, ']') + ",";
  const std::string many = "more than 8388608 lists and objects";
  ExpectRefused("solve " + File(R"({"A": [)", nest, kFileBytes, "[]]}"), many, 26);
  ExpectRefused("solve " + File(R"({"A": [)", "[],", kFileBytes, "[]]}"), many, 26);
  ExpectRefused("solve " + File(R"({"about": [)", R"({"a":[]},)", kFileBytes, "[]]}"), many, 26);
  // Fewer: it is read to its end, in a time that grows with its length and not with the square.
  ExpectRefused("solve " + File(R"({"about": [)", R"({"a":[]},)", kFileBytes / 10, "[]]}"), "\"A\" is missing", 12);
  ExpectRefused("ensemble " + QuotedExample("rectifier") + " " + File("[", "{},", kFileBytes / 100, "1]"), "members[",
                2);
}

TEST_F(HostileFileTest, LongTexts) {
  const std::string problem = R"({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[2]], "x0": [1], "g": [-1], )";
  ExpectRefused("solve " + File(problem + R"("T": 4, "f": ["t)", "+t", 10'000'000, R"("]})"), "at most 65536", 1);
  ExpectRefused("solve " + File(problem + R"("f": [0], "T": ")", "[", kFileBytes, R"("})"), "T is a string", 6);
  ExpectRefused("solve " + File(problem + R"("f": [0], ")", "k", kFileBytes, R"(": 4})"), "is not a known key", 6);
  ExpectRefused("solve " + File(problem + R"("f": [0], "T": ")", "x", kFileBytes, "\x01\"}"), "control character", 6);
  std::string keys = "{";
  for (int k = 0; k < 200'000; ++k) keys += '"' + std::to_string(k) + "\": 0, ";
  ExpectRefused("solve " + File(keys, R"("x": 1)", 1, "}"), "is not a known key", 1);
}

// A small file that describes a large matrix.
TEST_F(HostileFileTest, ShapesThatNobodyCanHold) {
  const std::string most = "2147483647";
  const std::string square = R"({"rows": )" + most + R"(, "columns": )" + most + R"(, "entries": []})";
  const std::string row = R"({"rows": 1, "columns": )" + most + R"(, "entries": []})";
  const std::string column = R"({"rows": )" + most + R"(, "columns": 1, "entries": []})";
  const std::string small = R"("x0": [1], "T": 4)";
  std::ofstream(folder_.File("many.mtx")) << "%%MatrixMarket matrix coordinate real general\n"
                                          << most << ' ' << most << " 0\n";
  std::ofstream(folder_.File("dense.mtx")) << "%%MatrixMarket matrix array real general\n"
                                           << most << ' ' << most << "\n1\n";
  struct Case {
    std::string a, b, n, m, words;
  };
  for (const Case& one : std::vector<Case>{
           {"[[-1]]", row, column, square, "g is missing, and zero in 2147483647 components"},
           {square, column, row, "[[1]]", "f is missing, and zero in 2147483647 components"},
           {R"({"kronecker_sum": [)" + square + ", " + square + "]}", column, row, "[[1]]", "f is missing"},
           {R"({"rows": 2147483648, "columns": 1, "entries": []})", "[[1]]", "[[1]]", "[[1]]",
            "whole number from 1 to"},
           {R"({"rows": 2000000000, "columns": 2000000000, "diagonals": {"0": 1}})", "[[1]]", "[[1]]", "[[1]]",
            "more than 67108864 entries"},
           {R"({"matrix_market": "many.mtx"})", "[[1]]", "[[1]]", "[[1]]", "f is missing"},
           {R"({"matrix_market": "dense.mtx"})", "[[1]]", "[[1]]", "[[1]]", "this file does not have"}}) {
    SCOPED_TRACE(one.a);
    const std::string file =
        File(R"({"A": )" + one.a + R"(, "B": )" + one.b + R"(, "N": )" + one.n + R"(, "M": )" + one.m + ", " + small,
             "}", 1, "");
    for (const std::string command : {"solve ", "analyze ", "submit "}) ExpectRefused(command + file, one.words, 0);
  }
}

}  // namespace
}  // namespace dlcs::client
