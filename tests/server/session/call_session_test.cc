// SPDX-License-Identifier: Apache-2.0
#include "server/session/call_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stop_token>
#include <string>
#include <vector>

#include "server/wire/errors.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> Fields(const absl::Status& status) {
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(status)) fields.push_back(violation.field);
  return fields;
}

TEST(RunLcpTest, SolvesOne) {
  v1::SolveLcpRequest request;
  *request.mutable_m() = testing::DenseMatrix(2, 2, {2, 1, 1, 2});
  request.add_q(-5);
  request.add_q(-6);
  const auto response = RunLcp(request, SessionLimits(), {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_EQ(response->verdict(), v1::LCP_STATUS_SOLVED);
  EXPECT_NEAR(response->y(0), 4.0 / 3, 1e-14);
  EXPECT_NEAR(response->y(1), 7.0 / 3, 1e-14);
  EXPECT_THAT(response->matrix_class(), HasSubstr("P"));
}

TEST(RunLcpTest, NamesWhatIsWrong) {
  v1::SolveLcpRequest request;
  *request.mutable_m() = testing::DenseMatrix(2, 2, {2, NAN, 1, 2});
  request.add_q(std::numeric_limits<double>::infinity());
  const absl::Status status = RunLcp(request, SessionLimits(), {}).status();
  EXPECT_THAT(Fields(status), ::testing::ElementsAre("m[0][1]", "q", "q[0]"));

  *request.mutable_m() = testing::DenseMatrix(1, 1, {-1});
  request.set_q(0, 1);
  request.set_rule(v1::SOLUTION_RULE_UNIQUE);
  EXPECT_THAT(Fields(RunLcp(request, SessionLimits(), {}).status()), ::testing::ElementsAre("rule"));

  SessionLimits limits;
  limits.max_constraints = 0;
  EXPECT_EQ(RunLcp(request, limits, {}).status().code(), absl::StatusCode::kResourceExhausted);
}

// M = (1, 1; 1, 1), q = (-1, -1): all y >= 0 with y_1 + y_2 = 1.
v1::SolveLcpRequest Segment() {
  v1::SolveLcpRequest request;
  *request.mutable_m() = testing::DenseMatrix(2, 2, {1, 1, 1, 1});
  request.add_q(-1);
  request.add_q(-1);
  return request;
}

TEST(RunLcpTest, FollowsTheRule) {
  v1::SolveLcpRequest request = Segment();
  request.set_rule(v1::SOLUTION_RULE_LEAST_NORM);
  auto response = RunLcp(request, SessionLimits(), {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_THAT(response->y(), ElementsAre(DoubleNear(0.5, 1e-12), DoubleNear(0.5, 1e-12)));
  EXPECT_THAT(response->rule(), HasSubstr("norm"));
  EXPECT_THAT(response->sets().j(), ElementsAre(0, 1));

  // The point of the segment nearest to (3/4, 0) in the first component: (3/4, 1/4).
  request.set_rule(v1::SOLUTION_RULE_MINIMIZER);
  *request.mutable_selector()->mutable_c() = testing::DenseMatrix(1, 2, {1, 0});
  request.mutable_selector()->add_b(0.75);
  response = RunLcp(request, SessionLimits(), {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_THAT(response->y(), ElementsAre(DoubleNear(0.75, 1e-12), DoubleNear(0.25, 1e-12)));
}

TEST(RunLcpTest, ListsAllBasicSolutions) {
  v1::SolveLcpRequest request = Segment();
  request.set_all_basic_solutions(true);
  const auto response = RunLcp(request, SessionLimits(), {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_TRUE(response->all().complete());
  ASSERT_EQ(response->all().solutions_size(), 2);
  for (const v1::BasicSolution& solution : response->all().solutions()) {
    EXPECT_NEAR(solution.y(0) + solution.y(1), 1, 1e-14);
    EXPECT_EQ(solution.y(0) * solution.y(1), 0);
  }
  ASSERT_EQ(response->all().faces_size(), 1);
  EXPECT_THAT(response->all().faces(0).basis(), ElementsAre(0, 1));
  EXPECT_FALSE(response->all().faces(0).point());
}

TEST(RunLcpTest, RefusesARuleWithoutItsSelectorAndTheOtherWayRound) {
  v1::SolveLcpRequest request = Segment();
  request.set_rule(v1::SOLUTION_RULE_MINIMIZER);
  EXPECT_THAT(Fields(RunLcp(request, SessionLimits(), {}).status()), ElementsAre("selector"));
  request.set_rule(v1::SOLUTION_RULE_LEAST_NORM);
  *request.mutable_selector()->mutable_c() = testing::DenseMatrix(1, 2, {1, 0});
  request.mutable_selector()->add_b(0);
  EXPECT_THAT(Fields(RunLcp(request, SessionLimits(), {}).status()), ElementsAre("selector"));
  *request.mutable_selector()->mutable_c() = testing::DenseMatrix(1, 2, {1});
  EXPECT_THAT(Fields(RunLcp(request, SessionLimits(), {}).status()), ElementsAre("selector.c"));
}

// A sparse matrix of a few bytes may have any size, and this one would be written down entry by entry.
TEST(RunLcpTest, RefusesASelectorWhoseShapeIsNotThatOfTheProblem) {
  v1::SolveLcpRequest request = Segment();
  request.set_rule(v1::SOLUTION_RULE_MINIMIZER);
  request.mutable_selector()->add_b(0);
  v1::SparseMatrix& c = *request.mutable_selector()->mutable_c()->mutable_sparse();
  for (const auto& [rows, columns] :
       {std::pair{2'147'483'647, 0}, {2'147'483'647, 2}, {1, 60'000'000}, {-1, 2}, {0, 2}}) {
    c.set_rows(rows);
    c.set_columns(columns);
    EXPECT_THAT(Fields(RunLcp(request, SessionLimits(), {}).status()), ElementsAre("selector.c"));
  }
}

// v' = 1 keeps w = -t + v at 0; -t as a path on [0, 2].
v1::SolveDcpRequest Falling() {
  v1::SolveDcpRequest request;
  *request.mutable_m() = testing::DenseMatrix(1, 1, {1});
  for (const double t : {0.0, 2.0}) {
    request.mutable_q()->add_times(t);
    request.mutable_q()->add_values(-t);
  }
  return request;
}

TEST(RunDcpTest, SolvesAndCertifies) {
  v1::SolveDcpRequest request = Falling();
  request.set_max_step(0.5);
  const auto response = RunDcp(request, SessionLimits(), {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_TRUE(response->solved());
  EXPECT_THAT(response->v().times(), ElementsAre(0, 0.5, 1, 1.5, 2));
  EXPECT_THAT(response->v().values(), ElementsAre(0, 0.5, 1, 1.5, 2));
  EXPECT_LE(response->certificate().complementarity(), 1e-15);
  EXPECT_EQ(response->unique().answer(), v1::ANSWER_YES);
}

TEST(RunDcpTest, TakesAThousandStepsWhereNoneIsGiven) {
  const auto response = RunDcp(Falling(), SessionLimits(), {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_EQ(response->v().times_size(), 1001);
}

TEST(RunDcpTest, MeasuresAPathInsteadOfSolving) {
  v1::SolveDcpRequest request = Falling();
  // v = 2t is increasing, but w = t > 0 while it increases: ∫ w dv = ∫ 2t dt = 4.
  for (const double t : {0.0, 2.0}) {
    request.mutable_check()->add_times(t);
    request.mutable_check()->add_values(2 * t);
  }
  const auto response = RunDcp(request, SessionLimits(), {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_FALSE(response->has_v());
  EXPECT_DOUBLE_EQ(response->certificate().complementarity(), 4);
  EXPECT_EQ(response->certificate().least_w(), 0);
  EXPECT_GT(response->certificate().least_increase(), 0);
}

TEST(RunDcpTest, StopsOnRequest) {
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(RunDcp(Falling(), SessionLimits(), source.get_token()).status().code(), absl::StatusCode::kCancelled);
}

TEST(RunDcpTest, NamesWhatIsWrong) {
  v1::SolveDcpRequest request = Falling();
  request.mutable_q()->add_values(0);
  EXPECT_THAT(Fields(RunDcp(request, SessionLimits(), {}).status()), ElementsAre("q"));
  request = Falling();
  request.mutable_q()->set_times(0, 1);
  EXPECT_THAT(Fields(RunDcp(request, SessionLimits(), {}).status()), ElementsAre("q.times[0]"));
  request = Falling();
  request.mutable_q()->set_values(0, -1);
  EXPECT_THAT(Fields(RunDcp(request, SessionLimits(), {}).status()), ElementsAre("q.values[0][0]"));
  request = Falling();
  request.set_max_step(-1);
  EXPECT_THAT(Fields(RunDcp(request, SessionLimits(), {}).status()), ElementsAre("max_step"));
  request = Falling();
  request.clear_m();
  EXPECT_THAT(Fields(RunDcp(request, SessionLimits(), {}).status()), ElementsAre("m"));
  request = Falling();
  request.mutable_q()->set_times(1, std::numeric_limits<double>::infinity());
  EXPECT_THAT(Fields(RunDcp(request, SessionLimits(), {}).status()), ElementsAre("q.times[1]"));
}

TEST(RunDcpTest, KeepsToTheLimits) {
  v1::SolveDcpRequest request = Falling();
  request.set_max_step(1e-300);
  SessionLimits limits;
  limits.max_steps = 1000;
  EXPECT_EQ(RunDcp(request, limits, {}).status().code(), absl::StatusCode::kResourceExhausted);
  request.set_max_step(1e-3);
  limits = {};
  limits.max_answer_bytes = 1000;
  const absl::Status status = RunDcp(request, limits, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("max_answer_bytes"));
  limits = {};
  limits.max_constraints = 0;
  EXPECT_EQ(RunDcp(request, limits, {}).status().code(), absl::StatusCode::kResourceExhausted);
}

// 4500² numbers are 162 MB each time that A is written down, and its matrix functions take minutes.
TEST(RunAnalysisTest, LeavesOutWhatNeedsAMatrixWrittenDown) {
  constexpr int kStates = 4500;
  v1::AnalyzeProblemRequest request;
  v1::Problem& problem = *request.mutable_problem();
  v1::SparseMatrix& a = *problem.mutable_a()->mutable_sparse();
  a.set_rows(kStates);
  a.set_columns(kStates);
  for (int i = 0; i < kStates; ++i) {
    a.add_row_indices(i);
    a.add_column_indices(i);
    a.add_values(-1);
    problem.add_x0(0);
  }
  problem.mutable_f()->mutable_lift()->mutable_sparse()->set_rows(kStates);
  problem.mutable_f()->mutable_lift()->mutable_sparse()->set_columns(1);
  problem.mutable_f()->add_pieces()->mutable_constant()->add_values(0);
  problem.mutable_g()->add_pieces()->mutable_constant()->add_values(1);
  for (v1::SparseMatrix* vector : {problem.mutable_b()->mutable_sparse(), problem.mutable_n()->mutable_sparse()}) {
    vector->set_rows(1);
    vector->set_columns(1);
    vector->add_row_indices(0);
    vector->add_column_indices(0);
    vector->add_values(1);
  }
  problem.mutable_b()->mutable_sparse()->set_rows(kStates);
  problem.mutable_n()->mutable_sparse()->set_columns(kStates);
  *problem.mutable_m() = testing::DenseMatrix(1, 1, {0});
  problem.set_horizon(1);
  request.mutable_options()->set_method(v1::METHOD_TIME_STEPPING);
  request.mutable_options()->set_steps(2);
  const auto response = RunAnalysis(request, SessionLimits{}, {});
  ASSERT_TRUE(response.ok()) << response.status();
  for (const char* id : {"relative-degree", "index-one"}) {
    const auto found = std::find_if(response->sections().begin(), response->sections().end(),
                                    [id](const v1::AnalysisSection& section) { return section.id() == id; });
    ASSERT_NE(found, response->sections().end()) << id;
    EXPECT_THAT(found->findings(0).reason(), ::testing::HasSubstr("not computed: too large, 4500 states and 1 pair"));
  }
}

}  // namespace
}  // namespace dlcs
