// SPDX-License-Identifier: Apache-2.0
#include "client/files/outputs_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client/files/problem_file.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string File(const std::string& rest) {
  return R"({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 1, "parameters": {"R": 2}, )" + rest +
         "}";
}

std::string Fault(const std::string& rest) {
  const auto file = ParseProblem(File(rest), "a.json");
  return file.ok() ? "" : std::string(file.status().message());
}

constexpr const char* kWhole = R"json("outputs": {"names": ["v(a,b)", "power", "i"], "C": [["1/R"], [0], [1]],
    "D": {"rows": 3, "columns": 1, "entries": [[2, 0, -1]]}, "h": ["sin(t)", 0, "R"], "hidden": 1, "limits": {"i": 5}},
  "measurements": [{"name": "mean", "kind": "average", "outputs": ["power", "i"], "begin": 0.25, "end": 0.75},
    {"name": "swing", "kind": "peak-to-peak", "outputs": ["i"]},
    {"name": "late", "kind": "delay", "at": {"time": 0.5},
     "until": {"outputs": ["v(a,b)"], "level": 2, "direction": "falling", "number": -1, "after": 0.125}}])json";

TEST(OutputsJsonTest, IsReadAndWrittenAgain) {
  const auto file = ParseProblem(File(kWhole), "a.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const v1::Problem& problem = file->problem;
  EXPECT_EQ(problem.outputs().names(0), "v(a,b)");
  EXPECT_EQ(problem.outputs().c().dense().formulas(0).formula(), "1/R");
  EXPECT_EQ(problem.outputs().d().sparse().values(0), -1);
  EXPECT_EQ(problem.outputs().h().pieces(0).formulas().formulas(2), "R");
  EXPECT_EQ(problem.outputs().limits(0).output(), 2);
  ASSERT_EQ(problem.measurements_size(), 3);
  EXPECT_THAT(problem.measurements(0).outputs(), ::testing::ElementsAre(1, 2));
  EXPECT_EQ(problem.measurements(0).end(), 0.75);
  EXPECT_EQ(problem.measurements(1).kind(), v1::MEASUREMENT_KIND_PEAK_TO_PEAK);
  EXPECT_FALSE(problem.measurements(1).has_end());
  EXPECT_EQ(problem.measurements(2).until().direction(), v1::CROSSING_DIRECTION_FALLING);
  EXPECT_EQ(problem.measurements(2).until().number(), -1);
  const auto again = ParseProblem(ProblemJson(problem).dump(), "again.json");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->problem.SerializeAsString(), problem.SerializeAsString());
}

TEST(OutputsJsonTest, FaultsHaveTheirPlace) {
  EXPECT_EQ(Fault(R"("outputs": {"names": ["a"]})"), "");
  EXPECT_THAT(Fault(R"("outputs": ["a"])"), HasSubstr("outputs is a list"));
  EXPECT_THAT(Fault(R"("outputs": {"C": [[1]]})"), HasSubstr("has no \"names\""));
  EXPECT_THAT(Fault(R"("outputs": {"names": ["a"], "c": [[1]]})"), AllOf(HasSubstr("outputs"), HasSubstr("\"C\"")));
  EXPECT_THAT(Fault(R"("outputs": {"names": ["a"], "h": {"pieces": [1]}})"), HasSubstr("outputs.h.pieces[0]"));
  EXPECT_THAT(Fault(R"("outputs": {"names": ["volts"], "limits": {"volt": 1}})"), HasSubstr("volts"));
  EXPECT_THAT(Fault(R"("measurements": [{"name": "m", "kind": "average", "outputs": ["a"]}])"), HasSubstr("none"));
  EXPECT_THAT(
      Fault(R"("outputs": {"names": ["a"]}, "measurements": [{"name": "m", "kind": "averge", "outputs": ["a"]}])"),
      AllOf(HasSubstr("measurements[0].kind"), HasSubstr("average")));
  EXPECT_THAT(Fault(R"("outputs": {"names": ["a"]}, "measurements": [{"name": "m", "outputs": ["a"]}])"),
              HasSubstr("kind"));
  EXPECT_THAT(
      Fault(R"("outputs": {"names": ["a"]}, "measurements": [{"name": "m", "kind": "time", "at": {"outputs": ["a"],
                    "number": 1.5}}])"),
      HasSubstr("measurements[0].at.number is 1.5"));
}

}  // namespace
}  // namespace dlcs::client
