// SPDX-License-Identifier: Apache-2.0
#include "core/nonlinear/josephy_newton.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// G(y) = M y + d∘y³ + q with M strictly diagonally dominant, d >= 0: one solution, and q is such that it is known.
TEST(JosephyNewton, FindsTheSolutionThatTheProblemWasBuiltFrom) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Index n = 6;
  JosephyNewton newton(Selection::kUnique);  // keeps Jacobians of other problems: they must not mislead it
  for (int trial = 0; trial < 1000; ++trial) {
    Matrix M = Matrix::NullaryExpr(n, n, [&] { return uniform(random); });
    M.diagonal().array() += n;
    const Vector d = Vector::NullaryExpr(n, [&] { return 10 * std::abs(uniform(random)); });
    const Vector s = Vector::NullaryExpr(n, [&] { return 3 * uniform(random); });
    const Vector solution = s.cwiseMax(0), w = (-s).cwiseMax(0);
    const Vector q = w - M * solution - d.cwiseProduct(solution.array().cube().matrix());
    const ComplementarityFunction function{
        [&](const Vector& y) -> Vector { return M * y + d.cwiseProduct(y.array().cube().matrix()) + q; },
        [&](const Vector& y) -> Matrix {
          return M + Matrix((3 * d.array() * y.array().square()).matrix().asDiagonal());
        }};
    Vector y = Vector::Zero(n);
    const ComplementarityResult result = newton.Solve(function, y);
    ASSERT_EQ(result.verdict, ComplementarityResult::Verdict::kSolved) << trial << ": " << result.why;
    EXPECT_LT(MaxAbs(y - solution), 1e-10) << trial;
    EXPECT_GE(y.minCoeff(), 0);
  }
}

TEST(JosephyNewton, LeavesASolutionThatIsNotTheLeast) {
  Matrix M(2, 2);
  M << 0, -1, -1, 0;  // y = (1, 1) and y = (0, 0) both solve LCP((1, 1), M)
  const ComplementarityFunction function{[&](const Vector& y) -> Vector { return M * y + Vector::Ones(2); },
                                         [&](const Vector&) { return M; }};
  Vector y = Vector::Ones(2);
  const ComplementarityResult result = JosephyNewton(Selection::kLeastElement).Solve(function, y);
  EXPECT_EQ(result.verdict, ComplementarityResult::Verdict::kSolved);
  EXPECT_EQ(result.lcps, 1);
  EXPECT_EQ(MaxAbs(y), 0);
}

// The problem of Kojima and Shindo: a degenerate solution (√6/2, 0, 0, 1/2) and another, (1, 0, 3, 0).
TEST(JosephyNewton, SolvesTheProblemOfKojimaAndShindo) {
  const auto value = [](const Vector& y) -> Vector {
    const double a = y[0], b = y[1], c = y[2], d = y[3];
    return Vector{{3 * a * a + 2 * a * b + 2 * b * b + c + 3 * d - 6, 2 * a * a + a + b * b + 10 * c + 2 * d - 2,
                   3 * a * a + a * b + 2 * b * b + 2 * c + 9 * d - 9, a * a + 3 * b * b + 2 * c + 3 * d - 3}};
  };
  const auto jacobian = [](const Vector& y) {
    const double a = y[0], b = y[1];
    Matrix J(4, 4);
    J << 6 * a + 2 * b, 2 * a + 4 * b, 1, 3, 4 * a + 1, 2 * b, 10, 2, 6 * a + b, a + 4 * b, 2, 9, 2 * a, 6 * b, 2, 3;
    return J;
  };
  const Vector degenerate{{std::sqrt(6) / 2, 0, 0, 0.5}}, regular{{1, 0, 3, 0}};
  for (const double start : {0.0, 0.5, 1.0, 2.0}) {
    Vector y = Vector::Constant(4, start);
    const ComplementarityResult result = JosephyNewton(Selection::kAny).Solve({value, jacobian}, y);
    ASSERT_EQ(result.verdict, ComplementarityResult::Verdict::kSolved) << start << ": " << result.why;
    // The degenerate solution is known only to the root of the residual.
    EXPECT_LT(std::min(MaxAbs(y - degenerate), MaxAbs(y - regular)), 1e-5) << y.transpose();
  }
}

TEST(JosephyNewton, SaysWhyThereIsNoSolution) {
  const ComplementarityFunction hopeless{[](const Vector& y) -> Vector { return -Vector::Ones(1) - y.cwiseAbs2(); },
                                         [](const Vector& y) -> Matrix { return -2 * y; }};
  Vector y = Vector::Zero(1);
  const ComplementarityResult result = JosephyNewton(Selection::kAny).Solve(hopeless, y);
  EXPECT_EQ(result.verdict, ComplementarityResult::Verdict::kInfeasible);
  EXPECT_GE(result.residual, 1);
  const ComplementarityFunction outside{
      [](const Vector&) -> Vector { return Vector::Constant(1, std::numeric_limits<double>::quiet_NaN()); },
      [](const Vector&) -> Matrix { return Matrix::Ones(1, 1); }};
  EXPECT_EQ(JosephyNewton(Selection::kAny).Solve(outside, y).verdict, ComplementarityResult::Verdict::kNonFinite);
}

}  // namespace
}  // namespace dlcs
