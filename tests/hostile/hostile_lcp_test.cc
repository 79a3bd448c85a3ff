// SPDX-License-Identifier: Apache-2.0
// LCPs in any units against all their solutions in integers.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "core/lcp/batch.h"
#include "core/lcp/lcp.h"
#include "core/lcp/structured/sparse_solver.h"
#include "core/linalg/norms.h"
#include "core/parallel/parallel.h"
#include "tests/hostile/exact_lcp.h"
#include "tests/hostile/hostile_count.h"
#include "tests/hostile/lcp_cases.h"

namespace dlcs {
namespace {

using testing::AsFile;
using testing::DoubleLcp;
using testing::ExactLcp;
using testing::HostileSeeds;
using testing::InUnits;
using testing::LcpCase;
using testing::LcpKind;
using testing::LcpUnits;
using testing::LeastComponents;
using testing::MakeLcpCase;
using testing::MakeUnits;
using testing::SolveExactly;

using Reals = std::vector<long double>;

// The allowed residual of a solution, relative to the numbers that it is summed from.
constexpr long double kRounding = 1e-13L;
// Inside of a march, and on the list of all, a solution is not polished: rounding grows with the condition, to 1e4
// here.
constexpr long double kUnpolished = 1e-11L;

// 1e15, nearly.
constexpr int kWidest = 50;

// One problem: as integers, all its solutions, and as the engine sees it.
struct Posed {
  LcpCase integers;
  LcpUnits units;
  ExactLcp exact;
  DoubleLcp doubles;

  // y in the units of the integers, in which it is compared.
  Reals InIntegerUnits(const Vector& y) const {
    Reals result;
    for (Index j = 0; j < y.size(); ++j) result.push_back(std::ldexp(static_cast<long double>(y[j]), units.column[j]));
    return result;
  }
};

// Whether y is a solution to rounding, each row in its own size.
bool IsSolution(const LcpCase& lcp, const Reals& y) {
  const std::size_t n = y.size();
  Reals w(n), size(n);
  for (std::size_t i = 0; i < n; ++i) {
    w[i] = static_cast<long double>(lcp.q[i]);
    size[i] = std::abs(w[i]);
    for (std::size_t j = 0; j < n; ++j) {
      w[i] += static_cast<long double>(lcp.M[i][j]) * y[j];
      size[i] += std::abs(static_cast<long double>(lcp.M[i][j])) * y[j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!(y[i] >= 0) || !(w[i] >= -kRounding * size[i])) return false;
    if (y[i] > 0 && w[i] > kRounding * size[i]) return false;
  }
  return true;
}

long double LargestOf(const Reals& y) {
  long double largest = 0;
  for (const long double entry : y) largest = std::max(largest, std::abs(entry));
  return largest;
}

// Each component in its own size. What is zero may be what rounding left of it.
template <typename Expected>
bool IsClose(const Reals& y, const Expected& expected, long double accuracy = kRounding) {
  for (std::size_t i = 0; i < y.size(); ++i) {
    const long double size = expected[i] != 0 ? std::abs(expected[i]) : LargestOf(y);
    if (!(std::abs(y[i] - expected[i]) <= accuracy * size)) return false;
  }
  return true;
}

struct Tally {
  int tried = 0, solved = 0, infeasible = 0, without_answer = 0;
};

// Checks every solver of the engine: the answer is never wrong, and a unique solution is found to `accuracy` in each
// component.
void Expect(const Posed& posed, LcpStatus verdict, const Vector& solution, const std::string& solver, Tally& tally,
            long double accuracy = kRounding) {
  SCOPED_TRACE(solver + "\n" + AsFile(posed.doubles));
  ++tally.tried;
  if (verdict == LcpStatus::kInfeasible) {
    ++tally.infeasible;
    EXPECT_FALSE(posed.exact.solvable()) << "it has a solution";
  } else if (verdict == LcpStatus::kSolved) {
    ++tally.solved;
    const Reals y = posed.InIntegerUnits(solution);
    EXPECT_TRUE(posed.exact.solvable()) << "it has none; y = " << solution.transpose();
    if (!posed.exact.solvable()) return;
    if (posed.exact.unique()) {
      EXPECT_TRUE(IsClose(y, posed.exact.vertices.front(), accuracy))
          << "not the one solution: y = " << solution.transpose();
    } else {
      EXPECT_TRUE(IsSolution(posed.integers, y)) << "no solution: y = " << solution.transpose();
    }
  } else {
    ++tally.without_answer;
    if (::testing::Test::HasFailure() || std::getenv("DLCS_HOSTILE_SHOW") != nullptr)
      std::printf("without an answer: %s %s %s\n", solver.c_str(), LcpStatusName(verdict),
                  AsFile(posed.doubles).c_str());
  }
}

// Rows and columns have units of their own where the class of the matrix does not depend on them.
bool HasFreeUnits(LcpKind kind) {
  return kind == LcpKind::kP || kind == LcpKind::kZ || kind == LcpKind::kM || kind == LcpKind::kAny;
}

Posed Pose(unsigned seed, int spread) {
  std::mt19937_64 generator(seed + 1u);
  Posed posed{MakeLcpCase(seed), {}, {}, {}};
  const auto n = static_cast<Index>(posed.integers.q.size());
  posed.units = MakeUnits(n, spread, !HasFreeUnits(posed.integers.kind), generator);
  posed.exact = SolveExactly(posed.integers.M, posed.integers.q);
  posed.doubles = InUnits(posed.integers, posed.units);
  return posed;
}

// The spreads take turns: integers as they are, and to 1e±6, 1e±10 and 1e±15.
int SpreadOf(int k) {
  constexpr int kSpreads[] = {0, 20, 33, kWidest};
  return kSpreads[(k / testing::kNumLcpKinds) % 4];
}

template <typename Test>
void ForCases(int few, const Test& test) {
  const testing::HostileRange range = HostileSeeds(few);
  for (int k = 0; k < range.count; ++k) {
    const unsigned seed = range.first_seed + static_cast<unsigned>(k);
    SCOPED_TRACE("seed " + std::to_string(seed));
    test(Pose(seed, SpreadOf(k)));
    if (::testing::Test::HasFatalFailure()) return;
  }
}

TEST(HostileLcpTest, IsRightInAnyUnits) {
  Tally tally;
  ForCases(1200, [&](const Posed& posed) {
    const auto result = SolveLcp(posed.doubles.M, posed.doubles.q, LcpRequest{});
    ASSERT_TRUE(result.ok()) << result.status();
    Expect(posed, result->verdict, result->y, result->method, tally);
    if (result->verdict == LcpStatus::kSolved && result->selection == Selection::kLeastElement) {
      EXPECT_TRUE(IsClose(posed.InIntegerUnits(result->y), LeastComponents(posed.exact))) << AsFile(posed.doubles);
    }
  });
  std::printf("%d LCPs: %d solved, %d infeasible, %d without an answer\n", tally.tried, tally.solved, tally.infeasible,
              tally.without_answer);
  EXPECT_GT(tally.solved, tally.tried / 3);
  EXPECT_GT(tally.infeasible, tally.tried / 10);
  EXPECT_LT(tally.without_answer, 1 + tally.tried / 100);
}

TEST(HostileLcpTest, ListsAllBasicSolutions) {
  int incomplete = 0;
  ForCases(300, [&](const Posed& posed) {
    const auto result = SolveLcp(posed.doubles.M, posed.doubles.q, LcpRequest{.all_basic_solutions = true});
    ASSERT_TRUE(result.ok()) << result.status();
    const BasicSolutions& all = *result->basic_solutions;
    SCOPED_TRACE(AsFile(posed.doubles));
    for (const BasicSolution& found : all.solutions) {
      const Reals y = posed.InIntegerUnits(found.y);
      EXPECT_TRUE(std::any_of(posed.exact.basic.begin(), posed.exact.basic.end(), [&](const testing::Fractions& one) {
        return IsClose(y, one, kUnpolished);
      })) << found.y.transpose();
    }
    if (!all.complete) {
      ++incomplete;
      return;
    }
    EXPECT_EQ(all.solutions.size(), posed.exact.basic.size());
    EXPECT_EQ(all.empty(), !posed.exact.solvable());
    EXPECT_TRUE(!all.unique() || posed.exact.unique());
  });
  EXPECT_LT(incomplete, 2 + HostileSeeds(300).count / 500);
}

// A rule either reports why it does not apply, or selects the solution that it promises.
TEST(HostileLcpTest, FollowsTheRuleInAnyUnits) {
  Tally tally;
  ForCases(400, [&](const Posed& posed) {
    for (const SolutionRule rule :
         {SolutionRule::kUnique, SolutionRule::kLeastElement, SolutionRule::kHiddenLeastElement,
          SolutionRule::kLeastNorm, SolutionRule::kSparsest}) {
      const auto result = SolveLcp(posed.doubles.M, posed.doubles.q, rule);
      if (!result.ok()) continue;
      Expect(posed, result->verdict, result->y, SelectionName(result->selection) + std::string(" by ") + result->method,
             tally);
      if (result->verdict == LcpStatus::kSolved && rule == SolutionRule::kSparsest) {
        for (const testing::Fractions& vertex : posed.exact.vertices) {
          const auto count =
              std::count_if(vertex.numerator.begin(), vertex.numerator.end(), [](auto y) { return y > 0; });
          EXPECT_LE((result->y.array() > 0).count(), count) << AsFile(posed.doubles);
        }
      }
      if (result->verdict != LcpStatus::kSolved || result->selection != Selection::kLeastNorm) continue;
      for (const testing::Fractions& vertex : posed.exact.vertices) {
        long double norm = 0;
        for (Index j = 0; j < result->y.size(); ++j)
          norm = std::hypot(norm, std::ldexp(vertex[static_cast<std::size_t>(j)], -posed.units.column[j]));
        EXPECT_LE(result->y.norm(), norm * (1 + 1e-8L)) << AsFile(posed.doubles);
      }
    }
  });
  std::printf("%d rules followed: %d solved, %d infeasible, %d without an answer\n", tally.tried, tally.solved,
              tally.infeasible, tally.without_answer);
  EXPECT_LT(tally.without_answer, 1 + tally.tried / 100);
}

// Those that solve for many right-hand sides, for a matrix in two parts, and for sparse matrices.
TEST(HostileLcpTest, EverySolverJudgesTheSameWay) {
  Tally tally;
  ForCases(400, [&](const Posed& posed) {
    const auto& [M, q] = posed.doubles;
    const Index n = q.size();
    const MatrixClass known = Classify(M, SolutionRule::kAuto);
    const SolutionChoice choice{*SelectRule(SolutionRule::kAuto, known), std::nullopt, known};
    const auto run = [&](LcpSolver* solver, const char* name) {
      if (solver == nullptr) return;
      Basis basis(static_cast<std::size_t>(n), 0);
      Vector y = Vector::Zero(n);
      const LcpStatus verdict = solver->Solve(q, Vector::Zero(n), basis, y);
      Expect(posed, verdict, y, name, tally, kUnpolished);
    };
    run(MakeLcpSolver(M, Selection::kAny).get(), "no class known");
    run(MakeSparseLcpSolver(M.sparseView(0, 0), choice).get(), "sparse");
    Matrix K = Matrix::Zero(n, n);  // a part of M: the sum has no rounding
    for (Index j = 0; j < n; ++j) K.col(j) = (j % 2 == 0 ? 0.5 : 0.0) * M.col(j);
    run(MakeCoupledLcpSolver(M - K, K, choice).get(), "coupled");

    Workers workers(1);
    Matrix solutions = Matrix::Zero(n, 3);
    const LcpBatchOutcome outcome =
        LcpBatch(M, choice).Solve(q.replicate(1, 3), Vector::Zero(n), workers, {}, solutions);
    Expect(posed, outcome.verdict, solutions.col(2), "batch", tally, kUnpolished);
  });
  std::printf("%d solves: %d solved, %d infeasible, %d without an answer\n", tally.tried, tally.solved,
              tally.infeasible, tally.without_answer);
  EXPECT_LT(tally.without_answer, 1 + tally.tried / 50);
}

// No tolerance is absolute: small numbers that are summed with nothing larger are not rounded to zero.
TEST(HostileLcpTest, JudgesAProblemByItsOwnNumbers) {
  for (const double q : {-1e-14, -1e-16, -1e-300}) {
    const auto result = SolveLcp(Matrix{{0}}, Vector{{q}}, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->verdict, LcpStatus::kInfeasible) << q;
    const auto beside = SolveLcp(Matrix{{0, 0}, {0, 1}}, Vector{{q, 1.0}}, SolutionRule::kAuto);
    ASSERT_TRUE(beside.ok());
    EXPECT_EQ(beside->verdict, LcpStatus::kInfeasible) << q;
    const auto solvable = SolveLcp(Matrix{{1}}, Vector{{q}}, SolutionRule::kAuto);
    ASSERT_TRUE(solvable.ok());
    EXPECT_EQ(solvable->verdict, LcpStatus::kSolved) << q;
    EXPECT_EQ(solvable->y[0], -q);
  }
}

// y = (3, 5) for any size of M and q; the basis {0} alone is singular.
TEST(HostileLcpTest, FindsTheFewestComponentsForMatricesOfAnySize) {
  for (const double size : {0x1p-26, 1.0, 0x1p26}) {
    for (const double of_q : {0x1p-40, 1.0, 0x1p40}) {
      const auto result = SolveLcp(size * Matrix{{1, -1}, {1, 0}}, of_q * Vector{{2, -3}}, SolutionRule::kSparsest);
      ASSERT_TRUE(result.ok());
      ASSERT_EQ(result->verdict, LcpStatus::kSolved) << size << ", " << of_q << ": " << result->message;
      EXPECT_LE(MaxAbs(result->y * (size / of_q) - Vector{{3, 5}}), 1e-12);
    }
  }
}

}  // namespace
}  // namespace dlcs
