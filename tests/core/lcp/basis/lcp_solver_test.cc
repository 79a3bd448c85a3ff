// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/lcp_solver.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "core/lcp/lcp.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

// Counts the searches of another solver.
class CountingSolver final : public LcpSolver {
 public:
  explicit CountingSolver(std::unique_ptr<LcpSolver> solver) : solver_(std::move(solver)) {}
  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override {
    ++searches;
    return solver_->Solve(q, tolerance, basis, y);
  }
  bool SolvesIn(const Basis& basis, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                Eigen::Ref<Vector> y) override {
    return solver_->SolvesIn(basis, q, tolerance, y);
  }
  LcpStats Account() const override { return solver_->Account(); }
  std::unique_ptr<LcpSolver> Clone() const override { return std::make_unique<CountingSolver>(solver_->Clone()); }

  int searches = 0;

 private:
  std::unique_ptr<LcpSolver> solver_;
};

TEST(BasisSuccessorsTest, ACycleIsSearchedForOnce) {
  constexpr Index n = 6;
  constexpr int kCycle = 3, kRounds = 5;
  LcpGenerator generator(3);
  const Matrix M = generator.PositiveDefinite(n);
  const Vector tolerance = Vector::Constant(n, 1e-14);
  std::vector<Vector> qs, solutions;
  std::vector<Basis> bases;
  for (int k = 0; k < kCycle; ++k) {
    qs.push_back(generator.SolvableQ(M, false));
    bases.emplace_back(n, 0);
    solutions.emplace_back(n);
    ASSERT_EQ(MakeLcpSolver(M, Selection::kAny)->Solve(qs.back(), tolerance, bases.back(), solutions.back()),
              LcpStatus::kSolved);
  }
  ASSERT_TRUE(bases[0] != bases[1] && bases[1] != bases[2] && bases[2] != bases[0]);
  CountingSolver solver(MakeLcpSolver(M, Selection::kAny));
  BasisSuccessors successors;
  Basis basis = bases[kCycle - 1];
  Vector y(n);
  for (int k = 0; k < kCycle * kRounds; ++k) {
    ASSERT_EQ(successors.Solve(solver, qs[k % kCycle], tolerance, basis, y), LcpStatus::kSolved);
    EXPECT_EQ(basis, bases[k % kCycle]) << k;
    EXPECT_LE((y - solutions[k % kCycle]).lpNorm<Eigen::Infinity>(), 1e-12) << k;
  }
  EXPECT_EQ(solver.searches, kCycle);
  // Another right-hand side is searched for, from whatever was before.
  Vector q = -qs[0];
  Basis cold(n, 0);
  Vector other(n);
  ASSERT_EQ(MakeLcpSolver(M, Selection::kAny)->Solve(q, tolerance, cold, other), LcpStatus::kSolved);
  ASSERT_EQ(successors.Solve(solver, q, tolerance, basis, y), LcpStatus::kSolved);
  EXPECT_LE((y - other).lpNorm<Eigen::Infinity>(), 1e-12);
}

TEST(LcpSolverTest, SolvesInNoOtherBasis) {
  constexpr Index n = 4;
  LcpGenerator generator(4);
  const Matrix M = generator.PositiveDefinite(n);
  const Vector tolerance = Vector::Constant(n, 1e-14), q = generator.SolvableQ(M, false);
  const auto solver = MakeLcpSolver(M, Selection::kAny);
  Basis basis(n, 0);
  Vector y(n), again(n);
  ASSERT_EQ(solver->Solve(q, tolerance, basis, y), LcpStatus::kSolved);
  int found = 0;
  for (int bits = 0; bits < 1 << n; ++bits) {
    Basis tried(n);
    for (Index i = 0; i < n; ++i) tried[static_cast<std::size_t>(i)] = bits >> i & 1;
    if (!solver->SolvesIn(tried, q, tolerance, again)) continue;
    ++found;
    EXPECT_EQ(tried, basis);
    EXPECT_EQ(again, y);
  }
  EXPECT_EQ(found, 1);
}

}  // namespace
}  // namespace dlcs
