// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/history_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

namespace dlcs {
namespace {

// A comparator whose output u in [0, 1] is 1 above c = 0, and 0 below c = -2h: y = (u, what drives it beyond 1),
// w = (-c - 2h u + y_2, 1 - u). Between the two it has three solutions.
constexpr double kHysteresis = 0.25;

struct Comparator {
  HistorySolver solver{(Matrix(2, 2) << -2 * kHysteresis, 1, -1, 0).finished()};
  Basis basis = {0, 0};
  Vector y = Vector::Zero(2);

  double At(double c) {
    const LcpStatus verdict = solver.Solve(Vector{{-c, 1}}, Vector::Zero(2), basis, y);
    EXPECT_EQ(verdict, LcpStatus::kSolved) << solver.Account().message;
    return y[0];
  }
};

TEST(HistorySolverTest, KeepsABranchWhileItLastsAndNeverRestsInTheMiddle) {
  Comparator comparator;
  for (const double c : {-2.0, -0.4, -0.01}) EXPECT_EQ(comparator.At(c), 0) << c;
  for (const double c : {1e-9, 0.3, -0.2, -0.49}) EXPECT_DOUBLE_EQ(comparator.At(c), 1) << c;
  for (const double c : {-0.5 - 1e-9, -0.3, -1e-6}) EXPECT_EQ(comparator.At(c), 0) << c;
  EXPECT_EQ(comparator.At(5), 1);
  EXPECT_DOUBLE_EQ(comparator.y[1], 5 + 2 * kHysteresis);
}

// Two comparators that drive each other: a flip-flop keeps the bit that was set.
TEST(HistorySolverTest, AFlipFlopKeepsItsBit) {
  // e_1 = s_1 - u_2 + 1/2, e_2 = s_2 - u_1 + 1/2; y = (u_1, y_1, u_2, y_2).
  const Matrix M = (Matrix(4, 4) << 0, 1, 1, 0, -1, 0, 0, 0, 1, 0, 0, 1, 0, 0, -1, 0).finished();
  HistorySolver solver(M);
  Basis basis = {1, 1, 0, 0};
  Vector y(4);
  const auto bit = [&](double set, double reset) {
    const Vector q{{-set - 0.5, 1, -reset - 0.5, 1}};
    EXPECT_EQ(solver.Solve(q, Vector::Zero(4), basis, y), LcpStatus::kSolved);
    return std::pair(y[0], y[2]);
  };
  EXPECT_EQ(bit(0, 0), std::pair(1.0, 0.0));
  EXPECT_EQ(bit(-1, 1), std::pair(0.0, 1.0));
  EXPECT_EQ(bit(0, 0), std::pair(0.0, 1.0));
  EXPECT_EQ(bit(1, -1), std::pair(1.0, 0.0));
  EXPECT_EQ(bit(0, 0), std::pair(1.0, 0.0));
}

// Eight comparators with the same input turn at once, and through a small K all depend on each other.
TEST(HistorySolverTest, ComparatorsThatTurnAtTheSameTimeDoNotWaitForEachOther) {
  constexpr Index kCount = 8;
  Matrix M = Matrix::Zero(2 * kCount, 2 * kCount);
  Vector of_c = Vector::Zero(2 * kCount), constant = of_c;
  for (Index k = 0; k < 2 * kCount; k += 2) {
    M.block(k, k, 2, 2) << -2 * kHysteresis, 1, -1, 0;
    of_c[k] = -1;
    constant[k + 1] = 1;
  }
  HistorySolver solver(M, Matrix::Constant(2 * kCount, 2 * kCount, 1e-9));
  Basis basis(static_cast<std::size_t>(2 * kCount), 0);
  Vector y(2 * kCount);
  for (const double c : {-1.0, 1e-4, -0.4, -0.6, 2.0}) {
    ASSERT_EQ(solver.Solve(of_c * c + constant, Vector::Zero(2 * kCount), basis, y), LcpStatus::kSolved);
    const bool is_high = c > -0.5 && c != -1;
    for (Index k = 0; k < 2 * kCount; k += 2) EXPECT_NEAR(y[k], is_high ? 1 : 0, 1e-6) << c;
  }
}

// Beside a comparator a block without folds, with many ties and entries of very different sizes. Every problem has a
// solution; of some the basis is too close to singular.
TEST(HistorySolverTest, SolvesBlocksWithoutFoldsWhereTiesEndEveryPath) {
  constexpr Index kSize = 14;
  std::mt19937 random(1);
  const auto below = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  int solved = 0;
  constexpr int kProblems = 2000;
  for (int problem = 0; problem < kProblems; ++problem) {
    Matrix G = Matrix::Zero(kSize, kSize / 2), skew = Matrix::Zero(kSize, kSize);
    for (Index k = 0; k < G.size(); ++k) G.data()[k] = below(3) == 0 ? std::ldexp(below(2) * 2 - 1, -6 * below(3)) : 0;
    for (Index k = 0; k < skew.size(); ++k) skew.data()[k] = below(4) == 0 ? below(3) - 1 : 0;
    const Matrix block = G * G.transpose() + skew - skew.transpose();
    Matrix M = Matrix::Zero(kSize + 2, kSize + 2);
    M.topLeftCorner(2, 2) << -2 * kHysteresis, 1, -1, 0;
    M.bottomRightCorner(kSize, kSize) = block;
    Vector y = Vector::Zero(kSize), w = y;
    for (Index i = 0; i < kSize; ++i) {
      const int kind = below(4);
      if (kind == 0) y[i] = std::ldexp(1 + below(3), -8 * below(3));
      if (kind == 1) w[i] = std::ldexp(1 + below(3), -8 * below(3));
    }
    Vector q(kSize + 2);
    q << 1, 1, w - block * y;
    HistorySolver solver(M, Matrix::Zero(kSize + 2, kSize + 2));
    Basis basis(kSize + 2, 0);
    Vector found(kSize + 2);
    solved += solver.Solve(q, Vector::Zero(kSize + 2), basis, found) == LcpStatus::kSolved;
  }
  EXPECT_GE(solved, 0.995 * kProblems);
}

TEST(HistorySolverTest, SaysWhereThePathDoesNotEnd) {
  HistorySolver solver(Matrix::Constant(1, 1, -1));
  Basis basis = {0};
  Vector y(1);
  EXPECT_EQ(solver.Solve(Vector::Constant(1, -1), Vector::Zero(1), basis, y), LcpStatus::kRay);
  EXPECT_FALSE(solver.Account().message.empty());
}

}  // namespace
}  // namespace dlcs
