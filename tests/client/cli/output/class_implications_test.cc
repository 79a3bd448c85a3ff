// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/class_implications.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <string>

#include "core/analysis/class_section.h"

namespace dlcs::client {
namespace {

Matrix RandomMatrix(std::mt19937& random) {
  const Index n = std::uniform_int_distribution<Index>(1, 4)(random);
  std::uniform_int_distribution<int> entry(-2, 3);
  return Matrix::NullaryExpr(n, n, [&] { return static_cast<double>(entry(random)); });
}

// Matrices of small integers, so that all classes occur, and their boundary cases.
TEST(ClassImplicationsTest, NoMatrixContradictsThem) {
  std::mt19937 random(20130);
  std::map<std::string, int> seen;
  for (int round = 0; round < 1000; ++round) {
    std::map<std::string_view, Answer> answers;
    Matrix M = RandomMatrix(random);
    if (round % 3 == 0) M = (M + M.transpose()).eval();                     // definite or not
    if (round % 3 == 1) M += 3.0 * Matrix::Identity(M.rows(), M.rows());    // more P-matrices
    if (round % 5 == 0) M = M.cwiseMin(Matrix(M.diagonal().asDiagonal()));  // Z-matrices
    const AnalysisSection section = ClassSection(M);
    for (const Finding& finding : section.findings) answers[finding.id] = finding.fact.answer;
    for (const auto& [narrow, wide] : ClassImplications()) {
      if (!answers.contains(narrow) || !answers.contains(wide)) continue;
      EXPECT_FALSE(answers[narrow] == Answer::kYes && answers[wide] == Answer::kNo)
          << narrow << " but not " << wide << "\n"
          << M;
      if (answers[narrow] == Answer::kYes) ++seen[std::string(narrow)];
    }
  }
  for (const char* narrow : {"m", "z", "p", "n", "positive-definite", "positive-semidefinite", "nondegenerate",
                             "type-i", "strictly-semicopositive", "q"}) {
    EXPECT_GT(seen[narrow], 0) << narrow << " was never tried";
  }
}

bool Reaches(std::string_view from, std::string_view to) {
  for (const auto& [narrow, wide] : ClassImplications()) {
    if (narrow == from && (wide == to || Reaches(wide, to))) return true;
  }
  return false;
}

// With a cycle, every answer would follow from another, and none would be printed.
TEST(ClassImplicationsTest, HaveNoCircles) {
  for (const auto& [narrow, wide] : ClassImplications()) EXPECT_FALSE(Reaches(wide, narrow)) << narrow << ", " << wide;
}

v1::AnalysisSection Section(v1::Answer p, v1::Answer p0) {
  v1::AnalysisSection section;
  v1::Finding& narrow = *section.add_findings();
  narrow.set_id("p");
  narrow.set_answer(p);
  v1::Finding& wide = *section.add_findings();
  wide.set_id("p0");
  wide.set_answer(p0);
  return section;
}

TEST(ClassImplicationsTest, YesFollowsUpwardsAndNoDownwards) {
  const v1::AnalysisSection both = Section(v1::ANSWER_YES, v1::ANSWER_YES);
  EXPECT_FALSE(Follows(both.findings(0), both));
  EXPECT_TRUE(Follows(both.findings(1), both));
  const v1::AnalysisSection none = Section(v1::ANSWER_NO, v1::ANSWER_NO);
  EXPECT_TRUE(Follows(none.findings(0), none));
  EXPECT_FALSE(Follows(none.findings(1), none));
  const v1::AnalysisSection border = Section(v1::ANSWER_NO, v1::ANSWER_YES);
  EXPECT_FALSE(Follows(border.findings(0), border));
  EXPECT_FALSE(Follows(border.findings(1), border));
}

}  // namespace
}  // namespace dlcs::client
