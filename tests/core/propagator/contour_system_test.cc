// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/contour_system.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/discretization/scheme.h"
#include "core/linalg/low_rank.h"
#include "core/linalg/norms.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using testing::AdvectedGrid;
using testing::GridShape;
using testing::WithDenseMatrices;

Matrix RandomMatrix(Index rows, Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return Matrix::NullaryExpr(rows, columns, [&] { return normal(random); });
}

std::unique_ptr<ContourSystem> MakeSystem(const Problem& problem) {
  std::string why_not;
  auto system = ContourSystem::Create(problem, Options(), why_not);
  EXPECT_TRUE(system) << why_not;
  return system;
}

// What dense matrices of one step say about the same y and f, node after node.
struct Reference {
  Segment segment;
  Matrix middles;  // m × J
};

Reference March(const Problem& problem, double step, Hold hold, const Vector& x, const Matrix& f, const Matrix& y) {
  const Problem dense = WithDenseMatrices(problem);
  const Scheme scheme =
      hold == Hold::kLinear ? ExponentialPiecewiseLinear(dense, step) : ExponentialPiecewiseConstant(dense, step);
  Reference reference;
  Segment& segment = reference.segment;
  const Index steps = f.cols() - 1;
  segment.steps = steps;
  segment.f = f;
  segment.y = y;
  segment.x.resize(x.size(), steps + 1);
  segment.x.col(0) = x;
  reference.middles.resize(x.size(), steps);
  for (Index j = 1; j <= steps; ++j) {
    Vector next = scheme.state * segment.x.col(j - 1) + scheme.f_before * f.col(j - 1) + scheme.f_after * f.col(j) +
                  scheme.y_after * y.col(j);
    Vector middle = scheme.mid_state * segment.x.col(j - 1) + scheme.mid_f_before * f.col(j - 1) +
                    scheme.mid_f_after * f.col(j) + scheme.mid_y_after * y.col(j);
    if (hold == Hold::kLinear) {
      next += scheme.y_before * y.col(j - 1);
      middle += scheme.mid_y_before * y.col(j - 1);
    }
    segment.x.col(j) = next;
    reference.middles.col(j - 1) = middle;
  }
  return reference;
}

constexpr double kTolerance = 1e-12;

// Memory, responses, free motion and states against the reference.
void ExpectServes(const Problem& problem, double step, Index steps, Hold hold, const std::string& what) {
  SCOPED_TRACE(what + (hold == Hold::kLinear ? ", linear" : ", constant") + ", h = " + std::to_string(step));
  const auto system = MakeSystem(problem);
  ASSERT_TRUE(system);
  const Index m = problem.num_states(), n = problem.num_constraints();
  Workers workers(1);
  const bool lifted = problem.f.is_lifted();
  RunSources sources{step, RandomMatrix(lifted ? problem.f.lift.cols() : m, 1, 1) * RandomMatrix(1, steps + 1, 2)};
  const Matrix f = lifted ? Matrix(problem.f.lift * sources.psi) : sources.psi;
  const Matrix y = RandomMatrix(n, steps + 1, 3);
  const Matrix no_f = Matrix::Zero(m, steps + 1), no_y = Matrix::Zero(n, steps + 1);
  const Vector at_rest = Vector::Zero(m);
  const Matrix N = problem.N.Dense();

  // Another start than x0 first, then x0 itself.
  for (const Vector& x : {Vector(RandomMatrix(m, 1, 4)), problem.x0}) {
    const Reference free = March(problem, step, hold, x, f, no_y);
    const FreeMotion motion = system->Move(x, sources, hold, workers, {});
    const double size = MaxAbs(N.cwiseAbs() * free.segment.x.cwiseAbs());
    EXPECT_LE(MaxAbs(motion.nodes - N * free.segment.x), kTolerance * size);
    EXPECT_LE(MaxAbs(motion.middles - N * free.middles), kTolerance * size);
  }

  const Reference driven = March(problem, step, hold, at_rest, no_f, y);
  const Matrix expected = N * driven.segment.x;
  const double size = MaxAbs(expected);
  const auto kernel = system->MakeKernel(step, hold, steps, workers, {});
  ASSERT_TRUE(kernel);
  const auto memory = kernel->Start(y.col(0));
  Vector q(n);
  for (Index j = 1; j <= steps; ++j) {
    memory->Next(q);
    if (j == 3) {
      const Matrix history = memory->History(4);
      Matrix stopped = y;
      stopped.rightCols(steps - 2).setZero();
      const Matrix later = N * March(problem, step, hold, at_rest, no_f, stopped).segment.x.middleCols(3, 4);
      EXPECT_LE(MaxAbs(history - later), kTolerance * size);
    }
    ASSERT_LE(MaxAbs(q + kernel->K0() * y.col(j) - expected.col(j)), kTolerance * size) << j;
    memory->Push(y.col(j));
  }
  EXPECT_LE(MaxAbs(kernel->RespondAtMiddles(y, workers) - N * driven.middles), kTolerance * size);
  Matrix without_start = y;
  without_start.col(0).setZero();
  const Matrix response = N * March(problem, step, hold, at_rest, no_f, without_start).segment.x;
  EXPECT_LE(MaxAbs(kernel->Respond(y.rightCols(steps), workers) - response.rightCols(steps)), kTolerance * size);
  EXPECT_GE(kernel->Bound(steps) * step * (1 + 1e-12), InfinityNorm(kernel->K0()));

  const Reference all = March(problem, step, hold, problem.x0, f, y);
  for (const std::vector<Index>& nodes : {std::vector<Index>{1, 2, steps}, std::vector<Index>{steps}}) {
    const Matrix states = system->States(problem.x0, sources, y, hold, nodes, workers, {});
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      EXPECT_LE(MaxAbs(states.col(static_cast<Index>(k)) - all.segment.x.col(nodes[k])),
                kTolerance * MaxAbs(all.segment.x));
    }
  }
}

TEST(ContourSystemTest, ServesHeatInThePlaneAndInSpace) {
  for (const Hold hold : {Hold::kLinear, Hold::kConstant}) {
    ExpectServes(AdvectedGrid({.side = 10, .constraints = 4}), 0.02, 50, hold, "plane");
    ExpectServes(AdvectedGrid({.side = 5, .dimensions = 3, .constraints = 3}), 0.001, 40, hold, "space");
  }
}

TEST(ContourSystemTest, ServesAFlow) {
  ExpectServes(AdvectedGrid({.side = 10, .constraints = 4, .speed = 0.5}), 0.02, 50, Hold::kLinear, "slow");
  ExpectServes(AdvectedGrid({.side = 10, .constraints = 4, .speed = 1.5}), 0.01, 30, Hold::kConstant, "faster");
}

TEST(ContourSystemTest, ServesSourcesWithoutALift) {
  Problem problem = AdvectedGrid({.side = 8, .constraints = 2});
  problem.f = TimeFunction::Zero(64);
  ExpectServes(problem, 0.05, 20, Hold::kLinear, "no lift");
}

// Sparse, not normal, eigenvalues all over a disc left of the imaginary axis.
Problem RandomStable(Index m, unsigned seed, double margin) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<Index> index(0, m - 1);
  SparseMatrix A(m, m);
  for (Index k = 0; k < 4 * m; ++k) A.coeffRef(index(random), index(random)) += normal(random);
  for (Index i = 0; i < m; ++i) A.coeffRef(i, i) -= margin;
  Problem problem = AdvectedGrid({.side = 10, .constraints = 3});
  problem.A = StructuredMatrix(A);
  problem.B = RandomMatrix(m, 3, seed + 1);
  problem.N = RandomMatrix(3, m, seed + 2);
  problem.f = TimeFunction::Formulas({"t", "1"});
  problem.f.lift = RandomMatrix(m, 2, seed + 3);
  problem.x0 = RandomMatrix(m, 1, seed + 4);
  return problem;
}

TEST(ContourSystemTest, ServesRandomStableMatrices) {
  for (const Index m : {60, 200}) {
    ExpectServes(RandomStable(m, 11, 6), 0.02, 50, Hold::kLinear, "random " + std::to_string(m));
  }
}

TEST(ContourSystemTest, ServesSlowGrowthAndDefectiveEigenvalues) {
  Problem growing = AdvectedGrid({.side = 8, .constraints = 3});
  growing.A =
      StructuredMatrix(SparseMatrix(growing.A.Sparse() + 1.5 * SparseMatrix(Matrix::Identity(64, 64).sparseView())));
  ExpectServes(growing, 0.02, 50, Hold::kLinear, "growing");

  Problem defective = AdvectedGrid({.side = 8, .constraints = 3});
  SparseMatrix chain(64, 64);
  for (Index i = 0; i < 64; ++i) {
    chain.coeffRef(i, i) = -2;
    if (i > 0) chain.coeffRef(i, i - 1) = 1.5;
  }
  defective.A = StructuredMatrix(chain);
  ExpectServes(defective, 0.02, 50, Hold::kLinear, "defective");
}

TEST(ContourSystemTest, RefusesWhatNoContourServes) {
  std::string why_not;
  Problem problem = AdvectedGrid({.side = 8, .constraints = 3});
  SparseMatrix spinning(64, 64);
  for (Index i = 0; i < 64; i += 2) {
    spinning.coeffRef(i, i + 1) = 300;
    spinning.coeffRef(i + 1, i) = -300;
  }
  problem.A = StructuredMatrix(spinning);
  EXPECT_FALSE(ContourSystem::Create(problem, Options(), why_not));
  EXPECT_NE(why_not.find("oscillate too fast"), std::string::npos) << why_not;

  problem = AdvectedGrid({.side = 8, .constraints = 3});
  Options options;
  options.max_memory = 1000;
  EXPECT_FALSE(ContourSystem::Create(problem, options, why_not));
  EXPECT_NE(why_not.find("--max-memory"), std::string::npos) << why_not;
}

TEST(ContourSystemTest, FactorsEachNodeOnceWhereTheFactorsFit) {
  const Problem problem = AdvectedGrid({.side = 10, .constraints = 4});
  const auto system = MakeSystem(problem);
  Workers workers(2);
  const RunSources sources{0.01, Matrix::Ones(1, 101)};
  ASSERT_TRUE(system->MakeKernel(0.01, Hold::kLinear, 100, workers, {}));
  const Index factorizations = system->record().factorizations;
  EXPECT_EQ(factorizations, system->record().terms);
  system->Move(problem.x0, sources, Hold::kLinear, workers, {});
  system->States(2 * problem.x0, sources, Matrix::Ones(4, 101), Hold::kLinear, {50, 100}, workers, {});
  system->MakeKernel(0.01, Hold::kConstant, 100, workers, {});
  EXPECT_EQ(system->record().factorizations, factorizations);
}

TEST(ContourSystemTest, SystemsOfTheSameMatricesShareWhatDoesNotDependOnTheStart) {
  SetupCache setups(1e8);
  std::string why_not;
  Workers workers(2);
  const RunSources sources{0.01, Matrix::Ones(1, 101)};
  const auto free_motion = [&](const Problem& problem, SetupCache* cache) {
    const auto system = ContourSystem::Create(problem, Options(), why_not, cache);
    system->MakeKernel(0.01, Hold::kLinear, 100, workers, {});
    return system->Move(problem.x0, sources, Hold::kLinear, workers, {}).nodes;
  };
  Problem problem = AdvectedGrid({.side = 10, .constraints = 4});
  free_motion(problem, &setups);
  EXPECT_EQ(setups.statistics().misses, 1);
  problem.x0 = RandomMatrix(100, 1, 6);
  EXPECT_EQ(free_motion(problem, &setups), free_motion(problem, nullptr));
  EXPECT_EQ(setups.statistics().hits, 1);
  problem.B = StructuredMatrix(Matrix(2 * problem.B.Dense()));
  EXPECT_EQ(free_motion(problem, &setups), free_motion(problem, nullptr));
  EXPECT_EQ(setups.statistics().misses, 2);
  EXPECT_GT(setups.statistics().bytes, 0);
}

TEST(ContourSystemTest, SharesNothingThatWasInterrupted) {
  SetupCache setups(1e8);
  std::string why_not;
  Workers workers(1);
  const Problem problem = AdvectedGrid({.side = 10, .constraints = 4});
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_FALSE(ContourSystem::Create(problem, Options(), why_not, &setups)
                   ->MakeKernel(0.01, Hold::kLinear, 100, workers, stopped.get_token()));
  EXPECT_TRUE(
      ContourSystem::Create(problem, Options(), why_not, &setups)->MakeKernel(0.01, Hold::kLinear, 100, workers, {}));
  EXPECT_EQ(setups.statistics().values, 1);
}

TEST(ContourSystemTest, HasTheSameBitsForAnyNumberOfThreads) {
  const Problem problem = AdvectedGrid({.side = 10, .constraints = 4, .speed = 0.5});
  Matrix states[2], responses[2], free[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const auto system = MakeSystem(problem);
    Workers workers(threads);
    const RunSources sources{0.01, Matrix::Ones(1, 101)};
    const Matrix y = RandomMatrix(4, 101, 5);
    responses[threads - 1] = system->MakeKernel(0.01, Hold::kLinear, 100, workers, {})->RespondAtMiddles(y, workers);
    free[threads - 1] = system->Move(problem.x0, sources, Hold::kLinear, workers, {}).nodes;
    states[threads - 1] = system->States(problem.x0, sources, y, Hold::kLinear, {7, 100}, workers, {});
  }
  EXPECT_EQ(states[0], states[1]);
  EXPECT_EQ(responses[0], responses[1]);
  EXPECT_EQ(free[0], free[1]);
}

TEST(SectorTest, IsNarrowForHeatAndHoldsAFlow) {
  const auto heat = FindSector(AdvectedGrid({.side = 20}).A.Sparse(), 1);
  ASSERT_TRUE(heat);
  EXPECT_EQ(heat->angle, 0);
  EXPECT_EQ(heat->shift, 0);
  const auto flow = FindSector(AdvectedGrid({.side = 20, .speed = 1}).A.Sparse(), 1);
  ASSERT_TRUE(flow);
  // Every v*Av of a random v must lie inside.
  const Matrix A = AdvectedGrid({.side = 20, .speed = 1}).A.Dense();
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Eigen::VectorXcd v =
        RandomMatrix(400, 1, seed) + std::complex<double>(0, 1) * RandomMatrix(400, 1, seed + 100);
    const std::complex<double> value = v.dot(A * v) / v.squaredNorm();
    EXPECT_LE(std::abs(std::arg(flow->shift - value)), flow->angle);
  }
}

TEST(LowRankTest, FindsTheFewColumnsOfAProduct) {
  const Matrix product = RandomMatrix(40, 3, 1) * RandomMatrix(3, 25, 2);
  const LowRank factors = FactorByRank(product);
  EXPECT_LE(factors.columns.cols(), 4);
  EXPECT_LE(MaxAbs(factors.columns * factors.rows - product), 1e-13);
  EXPECT_EQ(FactorByRank(Matrix::Zero(5, 4)).columns.cols(), 0);
  const Matrix full = RandomMatrix(6, 9, 3);
  const LowRank all = FactorByRank(full);
  EXPECT_LE(MaxAbs(all.columns * all.rows - full), 1e-13);
}

TEST(LowRankTest, GivesUpWhereTheRankIsHigher) {
  const Matrix product = RandomMatrix(40, 3, 1) * RandomMatrix(3, 25, 2);
  const auto few = FactorIfRankIsAtMost(4, 0, product);
  ASSERT_TRUE(few);
  EXPECT_LE(MaxAbs(few->columns * few->rows - product), 1e-13);
  EXPECT_FALSE(FactorIfRankIsAtMost(2, 0, product));
  EXPECT_TRUE(FactorIfRankIsAtMost(0, 0, Matrix::Zero(5, 4)));
  const Matrix noisy = product + 1e-9 * RandomMatrix(40, 25, 4);
  EXPECT_FALSE(FactorIfRankIsAtMost(4, 1e-12, noisy));
  EXPECT_TRUE(FactorIfRankIsAtMost(4, 1e-7, noisy));
}

}  // namespace
}  // namespace dlcs
