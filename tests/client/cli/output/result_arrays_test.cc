// SPDX-License-Identifier: Apache-2.0
// What is written is read again by the readers of problem files; tests/client/array_files_test.py reads it with NumPy,
// SciPy and h5py.
#include "client/cli/output/result_arrays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/output/atomic_file.h"
#include "client/files/array_file.h"
#include "client/files/npy_array.h"
#include "client/files/problem_file.h"
#include "tests/client/cli/printed.h"

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kInf = std::numeric_limits<double>::infinity();

// Two states, one pair, three times, a left limit; the numbers do not end in binary.
SolveResult ArraysExample() {
  SolveResult result;
  result.states = 2;
  result.constraints = 1;
  result.names = {{"voltage", "i"}, {"diode"}};
  result.times = {0, 0.1, 1.0 / 3};
  result.x = {1, 0.1 + 0.2, -1e-300, 5e-324, 1.7976931348623157e308, -0.0};
  result.y = {0, 2.0 / 3, 1e16};
  result.w = {0.7, 0, -0.0};
  v1::LeftLimit& limit = result.left_limits.emplace_back();
  limit.set_index(1);
  limit.add_y(1.0 / 7);
  result.summary.set_message("≤ 𝛿");
  result.summary.add_switching_times()->set_time(0.1);
  return result;
}

template <typename Write>
std::string Written(Write write) {
  return Printed([&](std::FILE* out) {
    const absl::Status status = write(out);
    EXPECT_TRUE(status.ok()) << status;
  });
}
std::string NpyBytes(const SolveResult& result) {
  return Written([&](std::FILE* out) { return WriteNpy(result, out); });
}
std::string NpzBytes(const SolveResult& result) {
  return Written([&](std::FILE* out) { return WriteNpz(ArraysOf("title", result), out); });
}
std::string MatBytes(const SolveResult& result) {
  return Written([&](std::FILE* out) { return WriteMat(ArraysOf("title", result), out); });
}
std::string Hdf5Bytes(const SolveResult& result) {
  return Written([&](std::FILE* out) { return WriteHdf5(ArraysOf("title", result), out); });
}

StoredVariables AllIn(const std::string& bytes) {
  auto variables = ParseArrayFile(bytes, "file", [](const std::string&) { return true; });
  EXPECT_TRUE(variables.ok()) << variables.status();
  return variables.ok() ? *std::move(variables) : StoredVariables();
}

void ExpectSameBits(const StoredVariables& read, const std::string& name, std::size_t rows, std::size_t columns,
                    const std::vector<double>& values) {
  SCOPED_TRACE(name);
  const auto found = read.arrays.find(name);
  ASSERT_NE(found, read.arrays.end());
  ASSERT_TRUE(found->second.ok()) << found->second.status();
  const v1::DenseMatrix& dense = found->second->matrix.dense();
  EXPECT_EQ(static_cast<std::size_t>(dense.rows()), rows);
  EXPECT_EQ(static_cast<std::size_t>(dense.columns()), columns);
  ASSERT_EQ(static_cast<std::size_t>(dense.values_size()), values.size());
  EXPECT_EQ(std::memcmp(dense.values().data(), values.data(), 8 * values.size()), 0);
}

TEST(ResultArraysTest, NpzAndMatKeepEveryBit) {
  const SolveResult result = ArraysExample();
  for (const std::string& bytes : {NpzBytes(result), MatBytes(result)}) {
    const StoredVariables read = AllIn(bytes);
    ExpectSameBits(read, "t", 3, 1, result.times);
    ExpectSameBits(read, "x", 3, 2, result.x);
    ExpectSameBits(read, "y", 3, 1, result.y);
    ExpectSameBits(read, "w", 3, 1, result.w);
    ExpectSameBits(read, "switching_times", 1, 1, {0.1});
    ExpectSameBits(read, "left_times", 1, 1, {0.1});
    ExpectSameBits(read, "left_y", 1, 1, {1.0 / 7});
    ExpectSameBits(read, "left_w", 1, 1, {0});  // w does not jump
    EXPECT_THAT(read.names, ::testing::IsSupersetOf({"state_names", "pair_names"}));
  }
}

TEST(ResultArraysTest, NpyHasTheColumnsOfTheCsv) {
  const SolveResult result = ArraysExample();
  ExpectSameBits(
      AllIn(NpyBytes(result)), "", 3, 5,
      {0, 1, 0.1 + 0.2, 0, 0.7, 0.1, -1e-300, 5e-324, 2.0 / 3, 0, 1.0 / 3, 1.7976931348623157e308, -0.0, 1e16, -0.0});
}

TEST(ResultArraysTest, ServersWithoutWGiveNone) {
  SolveResult result = ArraysExample();
  result.w.clear();
  for (const std::string& bytes : {NpzBytes(result), MatBytes(result)}) {
    EXPECT_THAT(AllIn(bytes).names, ::testing::Not(::testing::Contains("w")));
  }
  EXPECT_EQ(AllIn(NpyBytes(result)).arrays.at("")->matrix.dense().columns(), 4);
}

TEST(ResultArraysTest, ResultsWithoutTimesAreEmptyArrays) {
  SolveResult result = ArraysExample();
  result.times = result.x = result.y = result.w = {};
  result.left_limits.clear();
  for (const std::string& bytes : {NpzBytes(result), MatBytes(result)}) {
    EXPECT_THAT(std::string(AllIn(bytes).arrays.at("x").status().message()), HasSubstr("is empty (0 x 2)"));
  }
  EXPECT_THAT(NpyBytes(result), HasSubstr("(0, 5)"));
  EXPECT_EQ(Hdf5Bytes(result).substr(1, 3), "HDF");
}

TEST(ResultArraysTest, ValuesThatAreNotFiniteAreWrittenAsTheyAre) {
  SolveResult result = ArraysExample();
  result.x[2] = -kInf;
  EXPECT_THAT(std::string(AllIn(MatBytes(result)).arrays.at("x").status().message()),
              HasSubstr("row 1, column 0 (from 0) -inf"));
}

TEST(ResultArraysTest, TheSameResultIsTheSameFile) {
  EXPECT_EQ(NpzBytes(ArraysExample()), NpzBytes(ArraysExample()));
  EXPECT_EQ(Hdf5Bytes(ArraysExample()), Hdf5Bytes(ArraysExample()));
}

TEST(ResultArraysTest, AFullDiskIsAnError) {
  for (const auto& write : {WriteNpz, WriteMat, WriteHdf5}) {
    std::FILE* const full = std::fopen("/dev/full", "wb");
    const SolveResult result = ArraysExample();
    const absl::Status status = write(ArraysOf("title", result), full);
    EXPECT_FALSE(status.ok() && FlushStream(full, "the disk").ok());
    std::fclose(full);
  }
}

// A file with some bytes changed, or cut off, is read or refused; sanitizers see what else happens.
TEST(ResultArraysTest, DamagedFilesAreReadOrRefused) {
  std::mt19937_64 random(20);
  const auto below = [&random](std::size_t bound) { return static_cast<std::size_t>(random() % bound); };
  for (const std::string& good : {NpyBytes(ArraysExample()), NpzBytes(ArraysExample()), MatBytes(ArraysExample())}) {
    for (int k = 0; k < 5000; ++k) {
      std::string bad = good;
      for (std::size_t changes = below(4); changes > 0; --changes) {
        bad[below(bad.size())] = static_cast<char>(below(3) == 0 ? below(256) : below(4) * 85);
      }
      if (below(4) == 0) bad.resize(below(bad.size()));
      const auto read = ParseArrayFile(bad, "file", [](const std::string&) { return true; });
      if (!read.ok()) {
        EXPECT_THAT(std::string(read.status().message()), ::testing::StartsWith("file: "));
      }
      EXPECT_FALSE(ParseProblem(bad, "file").ok());
    }
  }
}

}  // namespace
}  // namespace dlcs::client
