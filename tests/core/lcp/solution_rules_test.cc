// SPDX-License-Identifier: Apache-2.0
// What SolveLcp() does with the rules: what it refuses, and what a result carries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stop_token>
#include <string>
#include <vector>

#include "core/lcp/lcp.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using testing::LcpGenerator;

TEST(SolutionRulesTest, RefuseWhatTheyCannotServe) {
  LcpGenerator generator(6);
  const Matrix large = generator.Gaussian(13, 13);
  EXPECT_THAT(std::string(SolveLcp(large, Vector::Ones(13), SolutionRule::kLeastNorm).status().message()),
              HasSubstr("rule: least-norm needs a positive semidefinite M, or one with n <= 12"));
  EXPECT_THAT(std::string(SolveLcp(large, Vector::Ones(13), SolutionRule::kMinimizer).status().message()),
              HasSubstr("selector: missing; the rule minimizer needs C and b"));
  LcpRequest request{.all_basic_solutions = true};
  EXPECT_THAT(std::string(SolveLcp(Matrix::Identity(17, 17), Vector::Ones(17), request).status().message()),
              HasSubstr("all_basic_solutions: n = 17; must be at most 16"));
}

TEST(SolutionRulesTest, CarryWhatTheSolutionIs) {
  LcpRequest request{.rule = SolutionRule::kLeastElement, .all_basic_solutions = true};
  const auto result = SolveLcp(testing::ChenXiangExample41(), Vector{{-1.0, 1, 1, 1}}, request);
  ASSERT_TRUE(result.ok());
  EXPECT_THAT(result->matrix_class, HasSubstr("Z-matrix"));
  EXPECT_EQ(result->selection, Selection::kLeastElement);
  EXPECT_EQ(result->sets.J, std::vector<Index>{0});
  EXPECT_EQ(result->basic_solutions->solutions.size(), 2u);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(SolveLcp(Matrix::Identity(2, 2), Vector::Ones(2), LcpRequest{}, stop.get_token()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace dlcs
