// SPDX-License-Identifier: Apache-2.0
// SolveLcp(): verdicts, certificates and refusals; random problems of every class, judged by residual, by
// linear programming and by enumeration.
#include "core/lcp/lcp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/linalg/norms.h"
#include "tests/support/lcp_linear_program.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using testing::LcpGenerator;

double NormOf(const Matrix& M) { return M.cwiseAbs().rowwise().sum().maxCoeff(); }

// The promise of the service: residual <= 1e-10 (1 + ‖q‖ + ‖M‖‖y‖), y >= 0.
void ExpectSolved(const Matrix& M, const Vector& q, const absl::StatusOr<LcpResult>& result) {
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(result->verdict, LcpStatus::kSolved) << result->message << "\nM =\n" << M << "\nq = " << q.transpose();
  EXPECT_GE(result->y.minCoeff(), 0);
  const double size = 1 + q.lpNorm<Eigen::Infinity>() + NormOf(M) * result->y.lpNorm<Eigen::Infinity>();
  EXPECT_LE(LcpResidual(M, q, result->y), 1e-10 * size);
  EXPECT_EQ(result->residual, LcpResidual(M, q, result->y));
  EXPECT_LE((result->w - q - M * result->y).lpNorm<Eigen::Infinity>(), 1e-13 * size);
}

TEST(SolveLcpTest, NamesTheEntryThatBreaksARule) {
  const Matrix M = Matrix::Identity(2, 2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(std::string(SolveLcp(Matrix(2, 3), Vector::Ones(2), SolutionRule::kAuto).status().message()),
              HasSubstr("M: 2x3; must be square"));
  EXPECT_THAT(std::string(SolveLcp(Matrix(0, 0), Vector(0), SolutionRule::kAuto).status().message()),
              HasSubstr("M: 0 rows; must be"));
  EXPECT_THAT(std::string(SolveLcp(M, Vector::Ones(3), SolutionRule::kAuto).status().message()),
              HasSubstr("q: 3 components; must be n = 2"));
  EXPECT_THAT(std::string(SolveLcp(M, Vector{{1.0, nan}}, SolutionRule::kAuto).status().message()),
              HasSubstr("q[1]: nan; every entry must be finite"));
  Matrix bad = M;
  bad(1, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(std::string(SolveLcp(bad, Vector::Ones(2), SolutionRule::kAuto).status().message()),
              HasSubstr("M[1][0]: inf; every entry must be finite"));
}

// The sum of both rows is -2^-k y_1 - 5 · 2^-k >= 0 up to the sign of its rounding: y = (5, 5) solves it exactly.
TEST(SolveLcpTest, RowsThatNearlyContradictEachOtherAreNoProof) {
  for (const int bits : {30, 34, 37, 40, 44}) {
    const double gap = std::ldexp(1, -bits);
    const Matrix M{{-4 + gap, 4}, {4, -4}};
    const Vector q{{-5 * gap, 0}};
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->verdict, LcpStatus::kSolved) << bits << ": " << result->message;
    EXPECT_LE(LcpResidual(M, q, result->y), 1e-12 * (1 + MaxAbs(result->y)));
  }
}

// Solved by y = (20, 5, 0, 2), w = 0 alone. Its bases have solutions with errors of 1e-5, where signs prove nothing.
TEST(SolveLcpTest, SignsWithinRoundingAreNoProof) {
  for (const int bits : {30, 34, 37, 40, 42}) {
    const double gap = std::ldexp(1, -bits);
    const Matrix M{{-2, -6 + gap, 2 - gap, 0}, {1, 3, -1, 0}, {2, -2, -4, 3}, {-4, 1, 2, 3}};
    const Vector q{{70 - 5 * gap, -35, -36, 69}};
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->verdict, LcpStatus::kSolved) << bits << ": " << result->message;
    EXPECT_LE(LcpResidual(M, q, result->y), 1e-12 * (1 + MaxAbs(result->y)));
  }
}

// Near a fixed boundary the states of a diffusion are as small as this, with rows that follow none of the others.
TEST(SolveLcpTest, UnderflowIsNoFailure) {
  for (const Index n : {4, 60, 255}) {
    for (const double sign : {1.0, -1.0}) {
      Matrix M = Matrix::Identity(n, n);
      for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) M(i, j) += sign * 0.1 * std::pow(0.06, static_cast<double>(std::abs(i - j)));
      }
      for (const double size : {1.0, 1e-250, 1e-273, 1e-300, 1e-306}) {
        Vector q(n);
        for (Index i = 0; i < n; ++i) {
          const double wave = std::sin(3.0 * static_cast<double>(i));
          q[i] = i % 5 < 2 ? 0 : -size * wave * std::pow(0.2, static_cast<double>(i % 30));
        }
        for (const Selection selection : {Selection::kUnique, Selection::kAny}) {
          Basis basis(static_cast<std::size_t>(n), 0);
          Vector y(n);
          const auto solver = MakeLcpSolver(M, selection);
          EXPECT_EQ(solver->Solve(q, 1e-13 * q.cwiseAbs(), basis, y), LcpStatus::kSolved)
              << n << ", " << size << ": " << solver->Account().message;
          EXPECT_LE(LcpResidual(M, q, y), 1e-13 * size + std::numeric_limits<double>::min())
              << n << ", " << sign << ", " << size << ": " << solver->Account().method;
        }
      }
    }
  }
}

// What is lost to underflow counts as zero, and nothing larger.
TEST(SolveLcpTest, NumbersAboveUnderflowAreNoZeros) {
  struct Small {
    Matrix M;
    Vector q;
    LcpStatus verdict;
  };
  for (const auto& [M, q, verdict] : {Small{Matrix{{1, 1e18, 0}, {0, 0, 1}, {0, -1, 1}}, Vector{{-6e-297, 0, 0}}, {}},
                                      Small{Matrix{{2, 1e60}, {0, 1}}, Vector{{-6e-280, 1}}, {}},
                                      Small{Matrix{{0, 0}, {0, 1}}, Vector{{0, -8e-309}}, {}},
                                      Small{Matrix{{0}}, Vector{{-1.1e-308}}, LcpStatus::kInfeasible},
                                      Small{Matrix{{0, 0}, {0, -1}}, Vector{{0, -1.1e-308}}, LcpStatus::kInfeasible}}) {
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->verdict, verdict) << M << "\n" << q.transpose() << "\n" << result->message;
    const double smallest = (q.array() == 0).select(1, q.cwiseAbs()).minCoeff();
    if (verdict == LcpStatus::kSolved) {
      EXPECT_LE(LcpResidual(M, q, result->y), 1e-12 * smallest);
    }
  }
}

TEST(SolveLcpTest, RefusesARuleThatMatrixDoesNotAdmit) {
  const Matrix M{{1, 2}, {3, 1}};
  const absl::Status unique = SolveLcp(M, Vector::Ones(2), SolutionRule::kUnique).status();
  EXPECT_EQ(unique.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unique.message()), HasSubstr("rows {0, 1}"));
  EXPECT_THAT(std::string(SolveLcp(M, Vector::Ones(2), SolutionRule::kLeastElement).status().message()),
              HasSubstr("M[0][1] = 2"));
}

TEST(SolveLcpTest, FindsTheLeastOfSeveralSolutions) {
  // Solutions for q = (-1, 2, 2, 3): y = (1, a, b, 0) with (a, b) one of (0,0), (2,2): the least has zeros.
  const absl::StatusOr<LcpResult> result =
      SolveLcp(testing::ChenXiangExample41(), Vector{{-1.0, 2, 2, 3}}, SolutionRule::kAuto);
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->verdict, LcpStatus::kSolved);
  EXPECT_EQ(result->y, (Vector{{1.0, 0, 0, 0}}));
}

// What is small beside other rows is not small in its own.
TEST(SolveLcpTest, TakesTheSmallestNumbersAsTheyStand) {
  const Vector q{{1.0, -1e-17}};
  for (const Matrix& M : {Matrix(Matrix::Zero(2, 2)), Matrix{{0., 1}, {-1, 0}}}) {
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->verdict, LcpStatus::kInfeasible);
  }
  const Matrix M = Matrix::Identity(2, 2);
  const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
  ExpectSolved(M, q, result);
  EXPECT_EQ(result->y, Vector({{0.0, 1e-17}}));
}

TEST(SolveLcpTest, SaysThatNothingIsFeasible) {
  const Matrix zero = Matrix::Zero(1, 1);
  EXPECT_EQ(SolveLcp(zero, Vector{{-1.0}}, SolutionRule::kAuto)->verdict, LcpStatus::kInfeasible);
  // Singular M-matrix: (1, 1)ᵀ M = 0, so the sum of w cannot be raised.
  const Matrix laplacian{{1, -1}, {-1, 1}};
  EXPECT_EQ(SolveLcp(laplacian, Vector{{-1.0, 0.5}}, SolutionRule::kAuto)->verdict, LcpStatus::kInfeasible);
  EXPECT_EQ(SolveLcp(laplacian, Vector{{-1.0, 1.0}}, SolutionRule::kAuto)->verdict, LcpStatus::kSolved);
  const Matrix skew{{0, -1}, {1, 0}};
  EXPECT_EQ(SolveLcp(skew, Vector{{-1.0, 1.0}}, SolutionRule::kAuto)->verdict, LcpStatus::kInfeasible);
}

TEST(SolveLcpTest, CallsNothingASolutionThatOverflowed) {
  const auto result = SolveLcp(Matrix{{1e-300}}, Vector{{-1e300}}, LcpRequest{});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->verdict, LcpStatus::kSingular);
  EXPECT_THAT(result->message, HasSubstr("too far apart"));
}

TEST(SolveLcpTest, FindsASolutionWhoseActiveBlockIsSingular) {
  // y = (0, 1) solves, but no complementary basis does: all diagonal entries and the determinant vanish.
  const Matrix M{{0, 1}, {0, 0}};
  const Vector q{{-1.0, 0.0}};
  ExpectSolved(M, q, SolveLcp(M, q, SolutionRule::kAuto));
}

TEST(SolveLcpTest, SaysThatNothingIsComplementaryAlthoughSomethingIsFeasible) {
  // w₁ = -1 + y₂ and w₂ = 1 - y₁ + ... : feasible y exist (0, 2), but w₂ > 0 forces y₂ = 0 and then w₁ < 0.
  const Matrix M{{0, 1}, {0, 0}};
  const absl::StatusOr<LcpResult> result = SolveLcp(M, Vector{{-1.0, 1.0}}, SolutionRule::kAuto);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->verdict, LcpStatus::kInfeasible) << result->message;
  EXPECT_EQ(result->method, "enumeration");
}

class RandomLcpTest : public ::testing::TestWithParam<Index> {};

TEST_P(RandomLcpTest, PMatricesAreSolved) {
  LcpGenerator generator(100 + GetParam());
  const int repetitions = GetParam() <= 20 ? 40 : 4;
  for (int k = 0; k < repetitions; ++k) {
    for (const Matrix& M : {generator.PositiveDefinite(GetParam()), generator.MMatrix(GetParam()),
                            generator.BadlyScaled(generator.MMatrix(GetParam()), 4)}) {
      const Vector q = generator.GaussianVector(GetParam());
      const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kUnique);
      ExpectSolved(M, q, result);
      Vector y;
      const Vector made = generator.SolvableQ(M, k % 2 == 0, &y);
      const absl::StatusOr<LcpResult> known = SolveLcp(M, made, SolutionRule::kAuto);
      ExpectSolved(M, made, known);
    }
  }
}

TEST_P(RandomLcpTest, UniqueSolutionIsTheOneThatTheProblemWasBuiltFrom) {
  LcpGenerator generator(200 + GetParam());
  const int repetitions = GetParam() <= 20 ? 40 : 4;
  for (int k = 0; k < repetitions; ++k) {
    const Matrix M = generator.PositiveDefinite(GetParam());
    Vector y;
    const Vector q = generator.SolvableQ(M, k % 2 == 0, &y);
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
    ExpectSolved(M, q, result);
    // λ_min of the symmetric part is at least 0.1: the error is at most ten residuals in the 2-norm.
    EXPECT_LE((result->y - y).norm(), 1e-10 * (1 + y.norm()));
  }
}

TEST_P(RandomLcpTest, ZMatricesGiveTheLeastElementOrNothingIsFeasible) {
  LcpGenerator generator(300 + GetParam());
  const int repetitions = GetParam() <= 20 ? 60 : 4;
  int infeasible = 0;
  int solved = 0;
  for (int k = 0; k < repetitions; ++k) {
    const Matrix M = k % 3 == 0   ? generator.SingularMMatrix(GetParam())
                     : k % 3 == 1 ? generator.ZMatrix(GetParam())
                                  : generator.MMatrix(GetParam());
    Vector q = generator.GaussianVector(GetParam());
    if (k % 4 < 2) q.array() += k % 4 + 0.5;
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kLeastElement);
    const std::optional<Vector> least = testing::MinimizeSumOverFeasible(M, q);
    ASSERT_TRUE(result.ok());
    if (least.has_value()) {
      ++solved;
      ExpectSolved(M, q, result);
      EXPECT_LE((result->y - *least).lpNorm<Eigen::Infinity>(), 1e-6 * (1 + least->lpNorm<Eigen::Infinity>()));
    } else {
      ++infeasible;
      EXPECT_EQ(result->verdict, LcpStatus::kInfeasible) << result->message;
    }
  }
  EXPECT_GT(solved, 0);
  if (GetParam() > 1) {
    EXPECT_GT(infeasible, 0);
  }
}

TEST_P(RandomLcpTest, PositiveSemidefiniteMatricesAreSolvedExactlyWhenFeasible) {
  LcpGenerator generator(400 + GetParam());
  const int repetitions = GetParam() <= 20 ? 40 : 4;
  for (int k = 0; k < repetitions; ++k) {
    const Matrix M =
        k % 2 == 0 ? generator.Skew(GetParam()) : generator.PositiveSemidefinite(GetParam(), (GetParam() + 1) / 2);
    const Vector q = k % 4 < 2 ? generator.GaussianVector(GetParam()) : generator.SolvableQ(M, k % 8 < 4);
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    if (testing::MinimizeSumOverFeasible(M, q).has_value()) {
      ExpectSolved(M, q, result);
    } else {
      EXPECT_EQ(result->verdict, LcpStatus::kInfeasible) << result->message;
    }
  }
}

TEST_P(RandomLcpTest, MatricesOfNoClassGetASolutionOrATrueVerdict) {
  LcpGenerator generator(500 + GetParam());
  const int repetitions = GetParam() <= 20 ? 40 : 4;
  for (int k = 0; k < repetitions; ++k) {
    const Matrix M = generator.Gaussian(GetParam(), GetParam());
    const Vector q = k % 2 == 0 ? generator.GaussianVector(GetParam()) : generator.SolvableQ(M, k % 4 == 1);
    const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    if (result->verdict == LcpStatus::kSolved) {
      ExpectSolved(M, q, result);
    } else if (GetParam() <= 12) {
      // Enumeration settles it: problems built from a solution are solved.
      EXPECT_EQ(result->verdict, LcpStatus::kInfeasible) << result->message;
      EXPECT_EQ(k % 2, 0);
    } else if (testing::MinimizeSumOverFeasible(M, q).has_value()) {
      EXPECT_NE(result->verdict, LcpStatus::kInfeasible);
    } else {
      EXPECT_EQ(result->verdict, LcpStatus::kInfeasible) << result->message;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, RandomLcpTest, ::testing::Values(1, 2, 3, 4, 7, 12, 20, 50, 200));

}  // namespace
}  // namespace dlcs
