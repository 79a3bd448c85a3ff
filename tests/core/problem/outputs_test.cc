// SPDX-License-Identifier: Apache-2.0
#include "core/problem/outputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "core/problem/problem.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Problem WithOutputs() {
  Problem problem = testing::Scalar(-1, -1, 1, 2);
  problem.outputs.names = {"v(out)", "i(D1)"};
  problem.outputs.C = Matrix::Ones(2, 1);
  problem.outputs.D = Matrix::Ones(2, 1);
  problem.outputs.h = TimeFunction::Formulas({"sin(t)", "1"});
  return problem;
}

std::vector<std::string> Fields(const Problem& problem) {
  std::vector<std::string> fields;
  for (const Violation& violation : Validate(problem)) fields.push_back(violation.field);
  return fields;
}

TEST(OutputsTest, AreCheckedWithTheProblem) {
  EXPECT_THAT(Fields(WithOutputs()), IsEmpty());
  Problem problem = WithOutputs();
  problem.outputs.names = {"a", "a"};
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.names[1]"));
  problem.outputs.names = {"", "a\nb"};
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.names[0]", "outputs.names[1]"));
  problem = WithOutputs();
  problem.outputs.C = Matrix::Ones(2, 3);
  problem.outputs.D(1, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.C", "outputs.D[1][0]"));
  problem = WithOutputs();
  problem.outputs.h = TimeFunction::Formulas({"sin(t)"});
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.h"));
  problem.outputs.h = TimeFunction::Formulas({"1/(t-1)", "t+"});
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.h[1]"));
  problem.outputs.h = TimeFunction::Formulas({"1/(t-1)", "t"});
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.h[0]"));  // a pole
  problem = WithOutputs();
  problem.outputs.hidden = 3;
  problem.outputs.limits = {{2, 1}, {0, 0}, {0, 1}};
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.hidden", "outputs.limits[0].output", "outputs.limits[1].value",
                                           "outputs.limits[2].output"));
  problem = WithOutputs();
  problem.outputs.names.clear();
  EXPECT_THAT(Fields(problem), ElementsAre("outputs.names"));
}

TEST(OutputsTest, BreakPointsOfOutputsAreThoseOfTheProblem) {
  Problem problem = WithOutputs();
  problem.outputs.h = TimeFunction::Formulas({"(t<0.7)*2", "abs(t-1.25)"});
  EXPECT_THAT(BreakPoints(problem), ElementsAre(0.7, 1.25));
}

TEST(MeasurementsTest, AreCheckedWithTheProblem) {
  const auto with = [](Measurement measurement) {
    Problem problem = WithOutputs();
    measurement.name = "m";
    problem.measurements = {std::move(measurement)};
    return Fields(problem);
  };
  EXPECT_THAT(with({.name = "", .outputs = {0, 1}, .end = {}}), IsEmpty());
  EXPECT_THAT(with({.name = "", .outputs = {}, .end = {}}), ElementsAre("measurements[0].outputs"));
  EXPECT_THAT(with({.name = "", .outputs = {2}, .end = {}}), ElementsAre("measurements[0].outputs[0]"));
  EXPECT_THAT(with({.name = "", .outputs = {0}, .begin = 1, .end = 0.5}), ElementsAre("measurements[0].end"));
  EXPECT_THAT(with({.name = "", .outputs = {0}, .begin = -1, .end = 3}),
              ElementsAre("measurements[0].begin", "measurements[0].end"));
  EXPECT_THAT(with({.name = "", .kind = MeasurementKind::kValue, .outputs = {0}, .end = {}}),
              ElementsAre("measurements[0].at"));
  MeasurementInstant instant{.time = 5, .outputs = {}};
  EXPECT_THAT(with({.name = "", .kind = MeasurementKind::kValue, .outputs = {0}, .end = {}, .at = instant}),
              ElementsAre("measurements[0].at.time"));
  instant = {.time = {}, .outputs = {0}, .level = 1, .number = 0, .after = 7};
  EXPECT_THAT(with({.name = "", .kind = MeasurementKind::kTime, .outputs = {}, .end = {}, .at = instant}),
              ElementsAre("measurements[0].at.number", "measurements[0].at.after"));
  instant = {.time = {}, .outputs = {}};
  EXPECT_THAT(with({.name = "", .kind = MeasurementKind::kDelay, .outputs = {}, .end = {}, .at = instant}),
              ElementsAre("measurements[0].until", "measurements[0].at"));
  Problem problem = WithOutputs();
  problem.measurements = {{.name = "m", .outputs = {0}, .end = {}}, {.name = "m", .outputs = {0}, .end = {}}};
  EXPECT_THAT(Fields(problem), ElementsAre("measurements[1].name"));
}

}  // namespace
}  // namespace dlcs
