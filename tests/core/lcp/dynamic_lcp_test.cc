// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dynamic_lcp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>

#include "core/linalg/norms.h"
#include "core/matrix_classes/semicopositive.h"
#include "core/matrix_classes/semicopositive_constant.h"
#include "tests/support/example_10.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

PiecewiseLinearPath RandomPath(LcpGenerator& generator, Index n, int nodes) {
  PiecewiseLinearPath path{{0}, Matrix::Zero(n, nodes)};
  path.values.col(0) = generator.GaussianVector(n).cwiseAbs();
  for (int k = 1; k < nodes; ++k) {
    path.times.push_back(path.times.back() + generator.Uniform(0.1, 1));
    path.values.col(k) = path.values.col(k - 1) + generator.GaussianVector(n);
  }
  return path;
}

DcpCertificate Check(const DcpProblem& problem, const PiecewiseLinearPath& v) {
  const auto certificate = CheckDcpSolution(problem, v);
  EXPECT_TRUE(certificate.ok()) << certificate.status();
  return certificate.value_or(DcpCertificate{});
}

void ExpectSolves(const DcpProblem& problem, const PiecewiseLinearPath& v) {
  const DcpCertificate certificate = Check(problem, v);
  EXPECT_EQ(certificate.start, 0);
  EXPECT_GE(certificate.least_increase, -1e-14);
  EXPECT_GE(certificate.least_w, -1e-14);
  EXPECT_LE(certificate.complementarity, 1e-14);
}

DcpSolution Solved(const DcpProblem& problem, double max_step) {
  auto solution = SolveDcp(problem, max_step);
  EXPECT_TRUE(solution.ok()) << solution.status();
  if (!solution.ok()) return {};
  EXPECT_TRUE(solution->solved) << solution->message;
  return *std::move(solution);
}

// n = 1 in closed form: v(t) = max(0, max over s <= t of -q(s))/M, the reflection of Skorokhod.
TEST(DcpTest, IsTheReflectionOfSkorokhodInOneDimension) {
  LcpGenerator generator(1);
  for (int k = 0; k < 20; ++k) {
    const DcpProblem problem{Matrix::Constant(1, 1, 2), RandomPath(generator, 1, 20)};
    const DcpSolution solution = Solved(problem, 1e9);
    ASSERT_EQ(solution.v.times, problem.q.times);
    double lowest = 0;
    for (Index j = 0; j < problem.q.values.cols(); ++j) {
      lowest = std::max(lowest, -problem.q.values(0, j));
      EXPECT_NEAR(solution.v.values(0, j), lowest / 2, 1e-14);
    }
    EXPECT_TRUE(solution.unique.yes());
  }
}

TEST(DcpTest, CertificateFallsWithTheStep) {
  LcpGenerator generator(2);
  const DcpProblem problem{generator.MMatrix(4), RandomPath(generator, 4, 12)};
  double before = 0;
  for (const double step : {0.1, 0.01, 0.001}) {
    const DcpSolution solution = Solved(problem, step);
    EXPECT_GE(solution.certificate.least_increase, 0);
    EXPECT_GE(solution.certificate.least_w, -1e-12);
    if (before > 0) {
      EXPECT_LT(solution.certificate.complementarity, 0.2 * before);
    }
    before = solution.certificate.complementarity;
  }
  EXPECT_GT(before, 0);
}

TEST(DcpTest, IsExactForJumpsAlone) {
  LcpGenerator generator(3);
  const Index n = 3;
  DcpProblem problem{generator.MMatrix(n), {{0}, Matrix::Zero(n, 1)}};
  problem.q.values.col(0).setOnes();
  for (int k = 1; k < 10; ++k) {
    problem.q.times.insert(problem.q.times.end(), {1.0 * k, 1.0 * k});
    problem.q.values.conservativeResize(n, problem.q.values.cols() + 2);
    problem.q.values.rightCols(2).col(0) = problem.q.values.col(problem.q.values.cols() - 3);
    problem.q.values.rightCols(1) = generator.GaussianVector(n);
  }
  const DcpSolution solution = Solved(problem, 1e9);
  EXPECT_GT(solution.v.values.rightCols(1).maxCoeff(), 0.1);
  EXPECT_LE(solution.certificate.complementarity, 1e-13);
  EXPECT_GE(solution.certificate.least_w, -1e-13);
}

// Proposition 1, one direction: v = t v̂ solves the DCP of q = max(0, -M v̂) t >= 0 when M is not strictly
// semicopositive.
TEST(DcpTest, MatricesThatAreNotStrictlySemicopositiveHaveANonzeroSolution) {
  for (const Matrix& M :
       {Matrix{{1, -2}, {-2, 1}}, Matrix{{0, 1}, {1, 1}}, Matrix{{1, -1, 0}, {0, 1, -2}, {-2, 0, 1}}}) {
    const Fact fact = TestStrictlySemicopositive(M);
    ASSERT_TRUE(fact.no());
    Vector direction = Vector::Zero(M.rows());
    direction(fact.witness.indices) = fact.witness.z;
    DcpProblem problem{M, {{0, 2}, Matrix::Zero(M.rows(), 2)}};
    problem.q.values.col(1) = 2 * (-(M * direction)).cwiseMax(0);
    PiecewiseLinearPath v{{0, 2}, Matrix::Zero(M.rows(), 2)};
    v.values.col(1) = 2 * direction;
    EXPECT_GT(MaxAbs(direction), 0);
    ExpectSolves(problem, v);
    ExpectSolves(problem, {{0, 2}, Matrix::Zero(M.rows(), 2)});  // and so does zero
  }
}

// Proposition 1, the other, and Proposition 5(b): q >= 0 leaves v at zero.
TEST(DcpTest, NonnegativeExcitationLeavesVAtZero) {
  LcpGenerator generator(4);
  for (int k = 0; k < 20; ++k) {
    DcpProblem problem{generator.MMatrix(3), RandomPath(generator, 3, 10)};
    problem.q.values = problem.q.values.cwiseAbs().eval();
    EXPECT_EQ(MaxAbs(Solved(problem, 0.05).v.values), 0);
  }
}

TEST(DcpTest, SolutionsAreBoundedAsProposition5Says) {
  LcpGenerator generator(5);
  for (const Matrix& M : {ExampleTenDcp(1).M, Matrix{{1, -2}, {0.5, 1}}, Matrix{{1, -0.75}, {-0.75, 1}}}) {
    const double sigma = TypeOneConstant(M).value;
    ASSERT_GT(sigma, 0);
    for (int k = 0; k < 20; ++k) {
      const DcpProblem problem{M, RandomPath(generator, M.rows(), 10)};
      const DcpSolution solution = Solved(problem, 0.01);
      EXPECT_LE(solution.v.values.maxCoeff(), (-problem.q.values).cwiseMax(0).maxCoeff() / sigma);
    }
  }
}

TEST(DcpTest, ExampleTenHasTheEvenSolutionAndAFamilyOfOthers) {
  const double horizon = 8;
  const DcpProblem problem = ExampleTenDcp(horizon);
  const PiecewiseLinearPath even = ExampleTenEvenSolution(horizon);
  ExpectSolves(problem, even);
  const DcpSolution stepped = Solved(problem, 0.5);
  EXPECT_LE(MaxAbs(stepped.v.values.rightCols(1) - even.values.rightCols(1)), 1e-14);
  EXPECT_FALSE(stepped.unique.yes());
  for (const double a : {1.0, 1.7, 3.0, 5.5, 7.9}) {
    const PiecewiseLinearPath switching = ExampleTenSwitchingSolution(a, horizon);
    ExpectSolves(problem, switching);
    EXPECT_GT(MaxAbs(switching.values.rightCols(1) - even.values.rightCols(1)), 0.1) << a;
  }
}

TEST(DcpTest, CheckSeesWhatIsWrong) {
  const DcpProblem problem = ExampleTenDcp(1);
  PiecewiseLinearPath v = ExampleTenEvenSolution(1);
  v.values(0, 1) += 0.01;
  EXPECT_GT(Check(problem, v).complementarity, 1e-4);  // w_0 > 0 while v_0 grows
  v.values(0, 1) -= 0.02;
  EXPECT_LT(Check(problem, v).least_w, -1e-3);
  v.values(0, 1) = -1;
  EXPECT_LT(Check(problem, v).least_increase, 0);
  v = ExampleTenEvenSolution(1);
  v.values.col(0).setConstant(0.1);
  EXPECT_GT(Check(problem, v).start, 0);
}

TEST(DcpTest, SaysWhatItRefusesAndWhereItFails) {
  DcpProblem problem = ExampleTenDcp(1);
  EXPECT_EQ(SolveDcp(problem, 0).status().code(), absl::StatusCode::kInvalidArgument);
  problem.q.values.col(0).setConstant(-1);
  EXPECT_EQ(SolveDcp(problem, 1).status().code(), absl::StatusCode::kInvalidArgument);
  problem = {Matrix::Constant(1, 1, -1), {{0, 1, 2}, Matrix{{1, 0, -1}}}};
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(SolveDcp(ExampleTenDcp(1), 0.1, source.get_token()).status().code(), absl::StatusCode::kCancelled);
  const auto failed = SolveDcp(problem, 1);
  ASSERT_TRUE(failed.ok());
  EXPECT_FALSE(failed->solved);
  EXPECT_EQ(failed->v.times.size(), 2u);
  EXPECT_TRUE(failed->unique.no());
}

TEST(DcpTest, KnowsWhereUniquenessIsGuaranteed) {
  EXPECT_TRUE(TestDcpUniqueness(Matrix{{2, 1}, {1, 2}}).yes());
  EXPECT_TRUE(TestDcpUniqueness(Matrix{{2, 1}, {-3, 2}}).yes());  // H: 2·2 > 1·3
  EXPECT_TRUE(TestDcpUniqueness(Matrix{{1, 2}, {2, 1}}).no());    // no P-matrix
  EXPECT_EQ(TestDcpUniqueness(ExampleTenDcp(1).M).answer, Answer::kUnknown);
}

}  // namespace
}  // namespace dlcs
