// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>

#include "core/analyze.h"
#include "server/wire/convert.h"

namespace dlcs {
namespace {

TEST(ConvertAnalysisTest, CarriesEveryPartOfAFinding) {
  Analysis analysis;
  AnalysisSection section{.id = "a", .title = "A", .findings = {}, .constants = {}, .warnings = {"w"}};
  Finding finding{.id = "p", .title = "P", .fact = {.answer = Answer::kNo, .why = "minor"}, .source = "(1)"};
  finding.fact.witness.indices = {0, 2};
  finding.fact.witness.value = -2.5;
  finding.fact.witness.z = Vector::LinSpaced(2, 1, 2);
  finding.fact.witness.X = (Matrix(2, 2) << 1, 2, 3, 4).finished();
  finding.fact.witness.Y = (Matrix(2, 2) << 5, 6, 7, 8).finished();
  finding.fact.witness.r = Vector::Constant(2, 0.5);
  finding.fact.witness.s = Vector::Constant(2, 0.25);
  section.findings = {finding, {.id = "q", .title = "Q", .fact = {.answer = Answer::kYes, .why = ""}, .source = ""}};
  analysis.sections.push_back(section);

  const v1::AnalyzeProblemResponse response = ToProto(analysis);
  ASSERT_EQ(response.sections_size(), 1);
  EXPECT_EQ(response.sections(0).warnings(0), "w");
  const v1::Finding& wire = response.sections(0).findings(0);
  EXPECT_EQ(wire.id(), "p");
  EXPECT_EQ(wire.title(), "P");
  EXPECT_EQ(wire.answer(), v1::ANSWER_NO);
  EXPECT_EQ(wire.reason(), "minor");
  EXPECT_EQ(wire.source(), "(1)");
  const v1::Witness& witness = wire.witness();
  ASSERT_EQ(witness.indices_size(), 2);
  EXPECT_EQ(witness.indices(1), 2);
  EXPECT_EQ(witness.value(), -2.5);
  EXPECT_EQ(witness.z(1), 2);
  EXPECT_EQ(witness.x().dense().values(1), 2);  // row-major
  EXPECT_EQ(witness.y().dense().values(2), 7);
  EXPECT_EQ(witness.r(0), 0.5);
  EXPECT_EQ(witness.s(1), 0.25);
  EXPECT_FALSE(response.sections(0).findings(1).has_witness());
  EXPECT_EQ(response.sections(0).findings(1).answer(), v1::ANSWER_YES);
}

TEST(ConvertAnalysisTest, TellsUnknownFromInfiniteConstants) {
  Analysis analysis;
  analysis.sections.push_back({.id = "a", .title = "A", .findings = {}, .constants = {}, .warnings = {}});
  Constant constant;
  constant.kind = ConstantKind::kUpperBound;
  analysis.sections[0].constants.push_back(constant);
  constant.value = std::numeric_limits<double>::infinity();
  constant.kind = ConstantKind::kEstimate;
  analysis.sections[0].constants.push_back(constant);
  const v1::AnalyzeProblemResponse response = ToProto(analysis);
  const v1::AnalysisSection& section = response.sections(0);
  EXPECT_FALSE(section.constants(0).has_value());
  EXPECT_EQ(section.constants(0).kind(), v1::CONSTANT_KIND_UPPER_BOUND);
  EXPECT_EQ(section.constants(1).value(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(section.constants(1).kind(), v1::CONSTANT_KIND_ESTIMATE);
}

TEST(ConvertAnalysisTest, CarriesTheRecommendation) {
  Analysis analysis;
  analysis.num_states = 3;
  analysis.num_constraints = 2;
  analysis.recommendation.options.method = Method::kTimeStepping;
  analysis.recommendation.options.step = 0.25;
  analysis.recommendation.reasons = {"because"};
  analysis.recommendation.refusal = "or not";
  analysis.warnings = {"mind"};
  const v1::AnalyzeProblemResponse response = ToProto(analysis);
  EXPECT_EQ(response.states(), 3);
  EXPECT_EQ(response.constraints(), 2);
  EXPECT_EQ(response.recommendation().options().method(), v1::METHOD_TIME_STEPPING);
  EXPECT_EQ(response.recommendation().options().step(), 0.25);
  EXPECT_EQ(response.recommendation().reasons(0), "because");
  EXPECT_EQ(response.recommendation().refusal(), "or not");
  EXPECT_EQ(response.warnings(0), "mind");
}

}  // namespace
}  // namespace dlcs
