// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/solution_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "core/lcp/dense/basic_solutions.h"

namespace dlcs {
namespace {

// Comparators in a network: u_k in [0, 1] is 1 while e_k = c_k + feedback of all u and y is positive. The first pairs
// are (u_k, what drives it beyond 1), the last ones those of a positive definite network that u drives too.
struct Comparators {
  Matrix M;
  Vector q, sign;
  std::vector<ClampBranches> clamps;

  Comparators(Index count, Index others, std::mt19937& generator) {
    std::uniform_real_distribution<double> value(-1, 1);
    const auto random = [&] { return value(generator); };
    const Index n = 2 * count + others;
    M = Matrix::Zero(n, n);
    q = Vector::NullaryExpr(n, random);
    sign = Vector::Ones(n);
    const Matrix root = Matrix::NullaryExpr(others, others, random);
    M.bottomRightCorner(others, others) = root * root.transpose() + 0.1 * Matrix::Identity(others, others);
    for (Index k = 0; k < count; ++k) {
      const Index low = 2 * k, high = low + 1;
      for (Index j = 0; j < count; ++j) M(low, 2 * j) = random();
      M.row(low).tail(others) = 0.3 * Vector::NullaryExpr(others, random).transpose();
      M.col(low).tail(others) = Vector::NullaryExpr(others, random);
      M(low, high) = 1;
      M(high, low) = -1;
      q[high] = 1;
      sign[low] = -1;
      clamps.push_back({.element = k, .node = k, .low = low, .high = high, .is_gate = false});
    }
  }
};

bool AreSame(const Vector& one, const Vector& other) {
  return (one - other).cwiseAbs().maxCoeff() < 1e-8 * (1 + one.cwiseAbs().maxCoeff());
}

// Against the search through all 2ⁿ bases.
TEST(SolutionBlocksTest, FindsAllSolutionsOfComparatorsWithFeedback) {
  std::mt19937 generator(20);
  int several = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Comparators made(1 + trial % 3, trial % 4, generator);
    const BasicSolutions expected = AllBasicSolutions(made.M, made.q);
    const BlockSolutions found =
        SolveByBlocks(made.M, made.q, 1e-12 * made.q.cwiseAbs(), Matrix(0, made.q.size()), made.clamps, made.sign);
    ASSERT_TRUE(expected.complete && expected.faces.empty());
    ASSERT_TRUE(found.undecided.empty());
    for (const BasicSolution& one : expected.solutions) {
      EXPECT_TRUE(std::any_of(found.all.begin(), found.all.end(),
                              [&](const BlockSolution& other) { return AreSame(one.y, other.y); }))
          << "trial " << trial;
    }
    for (const BlockSolution& one : found.all) {
      EXPECT_TRUE(std::any_of(expected.solutions.begin(), expected.solutions.end(),
                              [&](const BasicSolution& other) { return AreSame(one.y, other.y); }))
          << "trial " << trial;
    }
    several += expected.solutions.size() > 1 ? 1 : 0;
  }
  EXPECT_GT(several, 50);
}

// Sixty comparators, each with a hysteresis of its own, in a row: each drives the next one.
TEST(SolutionBlocksTest, TakesOneBlockAfterTheOther) {
  constexpr Index kCount = 60;
  Matrix M = Matrix::Zero(2 * kCount, 2 * kCount);
  Vector q(2 * kCount), sign(2 * kCount);
  std::vector<ClampBranches> clamps;
  for (Index k = 0; k < kCount; ++k) {
    const Index low = 2 * k, high = low + 1;
    M(low, low) = -0.5;
    M(low, high) = 1;
    M(high, low) = -1;
    if (k > 0) M(low, low - 2) = -3;
    // Only the first and the last one are between their thresholds.
    q[low] = k == 0 || k == kCount - 1 ? 0.25 : 1;
    if (k == kCount - 1) M(low, low - 2) = 0;
    q[high] = 1;
    sign[low] = -1;
    sign[high] = 1;
    clamps.push_back({.element = k, .node = k, .low = low, .high = high, .is_gate = true});
  }
  const BlockSolutions found = SolveByBlocks(M, q, Vector::Zero(q.size()), Matrix(0, q.size()), clamps, sign);
  ASSERT_TRUE(found.undecided.empty());
  EXPECT_EQ(found.all.size(), 9);  // low, in the middle and high, for each of the two
  for (const BlockSolution& one : found.all) {
    const double first = one.y[0];
    if (first == 0 || first == 1) {
      EXPECT_EQ(one.y[2 * kCount - 4], first);
    }
  }
}

// Seventeen pairs that no class and no clamp helps with are not searched.
TEST(SolutionBlocksTest, SaysWhichPairsItCannotDecide) {
  constexpr Index kCount = 17;
  Matrix M = Matrix::Constant(kCount, kCount, -1);
  M.diagonal().setConstant(0.5);
  const BlockSolutions found =
      SolveByBlocks(M, Vector::Constant(kCount, 1), Vector::Zero(kCount), Matrix(0, kCount), {}, Vector::Ones(kCount));
  EXPECT_EQ(found.undecided.size(), kCount);
}

// Two diodes in parallel share a current in any way; what depends on their sum is known, on one of them is not.
TEST(SolutionBlocksTest, WhatAConvexSetLeavesOpenIsSaid) {
  const Matrix M = Matrix::Ones(2, 2);
  const Vector q = Vector::Constant(2, -1), y = Vector{{0.5, 0.5}};
  EXPECT_EQ(FirstOpenRow(M, q, Matrix{{1, 1}}, y), -1);
  EXPECT_EQ(FirstOpenRow(M, q, Matrix{{1, 1}, {1, 0}}, y), 1);
  // A comparator behind one of them.
  Matrix whole = Matrix::Zero(4, 4);
  whole.topLeftCorner(2, 2) = M;
  whole(2, 0) = -1;
  whole(2, 2) = -0.5;
  whole(2, 3) = 1;
  whole(3, 2) = -1;
  const Vector q4{{-1, -1, 0.5, 1}};
  const std::vector<ClampBranches> clamps = {{.element = 0, .node = 0, .low = 2, .high = 3, .is_gate = true}};
  const Vector sign{{1, 1, -1, 1}};
  EXPECT_FALSE(SolveByBlocks(whole, q4, Vector::Zero(4), Matrix(0, 4), clamps, sign).undecided.empty());
  whole(2, 1) = -1;
  const BlockSolutions found = SolveByBlocks(whole, q4, Vector::Zero(4), Matrix(0, 4), clamps, sign);
  ASSERT_TRUE(found.undecided.empty());
  ASSERT_EQ(found.all.size(), 1);
  EXPECT_EQ(found.all.front().y[2], 1);
}

// Without clamps all bases of a block of no class are searched, as long as they are few.
TEST(SolutionBlocksTest, LeavesBlocksOfTooManyBasesUndecided) {
  std::mt19937 generator(15);
  std::uniform_real_distribution<double> value(-1, 1);
  const auto random = [&] { return value(generator); };
  for (const Index n : {Index{8}, Index{15}}) {
    Matrix M = Matrix::NullaryExpr(n, n, random);
    M(0, 0) = -1;
    const Vector q = Vector::NullaryExpr(n, random);
    const BlockSolutions found = SolveByBlocks(M, q, Vector::Zero(n), Matrix(0, n), {}, Vector::Ones(n));
    EXPECT_EQ(found.undecided.size(), n == 8 ? 0u : 15u);
    EXPECT_EQ(found.all.empty(), n == 15 || AllBasicSolutions(M, q).solutions.empty());
  }
}

}  // namespace
}  // namespace dlcs
