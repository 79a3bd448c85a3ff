// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/index_one.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stop_token>
#include <string>

#include "core/analysis/index_one_section.h"
#include "core/analyze.h"
#include "core/discretization/scheme.h"
#include "core/lcp/lcp.h"
#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "tests/support/index_one_problems.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

const Matrix kR{{1, 3, 0}, {0, 1, 3}, {3, 0, 1}};

Problem ProblemOf(const IndexOneSystem& system, const Vector& x0) { return testing::IndexOneProblem(system, x0, 1); }

const Finding& FindingOf(const AnalysisSection& section, const std::string& id) {
  const auto found =
      std::find_if(section.findings.begin(), section.findings.end(), [&](const Finding& f) { return f.id == id; });
  if (found == section.findings.end()) ADD_FAILURE() << id;
  return found == section.findings.end() ? section.findings.front() : *found;
}

// A random system with NB near the identity, so of index one.
IndexOneSystem RandomSystem(LcpGenerator& generator, Index m, Index n) {
  IndexOneSystem system{generator.Gaussian(m, m), Matrix::Zero(m, n), generator.Gaussian(n, m)};
  const Matrix target = Matrix::Identity(n, n) + 0.15 * generator.Gaussian(n, n);
  system.B = system.C.transpose() * (system.C * system.C.transpose()).inverse() * target;
  return system;
}

Vector OnTheUnitCube(LcpGenerator& generator, Index n) {
  Vector z = Vector::NullaryExpr(n, [&] { return generator.Integer(0, 2) == 0 ? 0.0 : generator.Uniform(0, 1); });
  z[generator.Integer(0, n - 1)] = 1;
  return z;
}

TEST(SemicopositiveConstantTest, IsBelowTheSampledMinimumAndPositiveForMMatrices) {
  LcpGenerator generator(20);
  for (int k = 0; k < 16; ++k) {
    const Index n = generator.Integer(2, 3);
    const Matrix M =
        k % 2 == 0 ? generator.MMatrix(n) : Matrix(Matrix::Identity(n, n) + 0.4 * generator.Gaussian(n, n));
    const double sigma = SemicopositiveConstant(M).value;
    double sampled = std::numeric_limits<double>::infinity();
    for (int trial = 0; trial < 2000; ++trial) {
      const Vector z = OnTheUnitCube(generator, n);
      sampled = std::min(sampled, z.cwiseProduct(M * z).maxCoeff());
    }
    EXPECT_LE(sigma, std::max(0.0, sampled));  // 0: none is known, or none exists
    const UpperBound above = SemicopositiveConstantAbove(M);
    EXPECT_EQ(above.value, above.z.cwiseProduct(M * above.z).maxCoeff());
    EXPECT_EQ(above.z.maxCoeff(), 1);
    EXPECT_GE(above.z.minCoeff(), 0);
    EXPECT_LE(above.value, sampled * (1 + 1e-9));
    if (sigma > 0) {
      EXPECT_GE(sigma, 0.98 * above.value) << M;
    }
    if (k % 2 == 0) {
      EXPECT_GT(sigma, 0) << M;
    }
  }
}

TEST(SemicopositiveConstantTest, IsTheSmallestDiagonalEntryOfNonnegativeMatrices) {
  EXPECT_EQ(SemicopositiveConstant(kR).value, 1);
  EXPECT_EQ(TypeOneConstant(kR).value, 0.5);
}

// [1 -a; -a 1]: the minimum of max z_i (Mz)_i is 1 - a at (1, 1), of zᵀMz on the faces 1 - a² at (1, a).
TEST(SemicopositiveConstantTest, ReachesClosedForms) {
  const Matrix M{{1, -0.75}, {-0.75, 1}};
  EXPECT_NEAR(SemicopositiveConstant(M).value, 0.25, 1e-12);
  EXPECT_NEAR(SemicopositiveConstantAbove(M).value, 0.25, 1e-9);
  const double type_one = TypeOneConstant(M).value;
  EXPECT_LE(type_one, (1 - 0.75 * 0.75) / 4);
  EXPECT_GE(type_one, 0.98 * (1 - 0.75 * 0.75) / 4);
  EXPECT_EQ(SemicopositiveConstant(Matrix{{1, -2}, {-2, 1}}).value, 0);
  EXPECT_LT(SemicopositiveConstantAbove(Matrix{{1, -2}, {-2, 1}}).value, 0);
}

// The definition of type I on random nondecreasing piecewise linear v, for all three classes of
// Proposition 3.
TEST(SemicopositiveConstantTest, BoundsTheIntegralOfTypeOne) {
  LcpGenerator generator(21);
  const Matrix matrices[] = {kR, Matrix{{1, -0.75}, {-0.75, 1}}, Matrix{{1, -2}, {0.5, 1}},
                             Matrix{{2, 3, -1}, {3, 6, 0}, {-1, 0, 1}}};
  for (const Matrix& M : matrices) {
    const double sigma = TypeOneConstant(M).value;
    ASSERT_GT(sigma, 0) << M;
    const Index n = M.rows();
    for (int trial = 0; trial < 300; ++trial) {
      Vector v = Vector::Zero(n), integral = Vector::Zero(n);
      for (int piece = 0; piece < 8; ++piece) {
        const Vector rise = OnTheUnitCube(generator, n) * std::exp2(generator.Integer(-4, 4));
        integral += rise.cwiseProduct(M * (v + 0.5 * rise));
        v += rise;
        EXPECT_GE(integral.maxCoeff(), sigma * v.maxCoeff() * v.maxCoeff() * (1 - 1e-12));
      }
    }
  }
}

TEST(IndexOneTest, StepsUpToTheBoundKeepTheConstantAndObeyTheirBounds) {
  LcpGenerator generator(22);
  int stepped = 0;
  for (int k = 0; k < 40; ++k) {
    const IndexOneSystem system = RandomSystem(generator, 4, 2);
    const SteppingBounds bounds = ComputeSteppingBounds(system);
    if (!(bounds.sigma.value > 0)) continue;
    for (const double fraction : {1.0, 0.3, 0.01}) {
      const double h = fraction * bounds.step;
      const Matrix resolvent = (Matrix::Identity(4, 4) - h * system.A).inverse();
      const Matrix reduced = system.C * resolvent * system.B;
      for (int trial = 0; trial < 30; ++trial) {
        const Vector z = OnTheUnitCube(generator, 2);
        EXPECT_GE(z.cwiseProduct(reduced * z).maxCoeff(), 0.5 * bounds.sigma.value);
      }
      Vector x = generator.GaussianVector(4);  // moved to Cx >= 0
      x += system.C.transpose() * (system.C * system.C.transpose()).inverse() * (-(system.C * x)).cwiseMax(0);
      const auto lcp = SolveLcp(h * reduced, system.C * resolvent * x, SolutionRule::kAuto);
      ASSERT_TRUE(lcp.ok());
      ASSERT_EQ(lcp->verdict, LcpStatus::kSolved);
      const Vector next = resolvent * (x + h * system.B * lcp->y);
      EXPECT_LE(MaxAbs(lcp->y), bounds.rho_u * MaxAbs(x) * (1 + 1e-9));
      EXPECT_LE(MaxAbs(next - x), h * bounds.psi_x * MaxAbs(x) * (1 + 1e-9));
      ++stepped;
    }
  }
  EXPECT_GT(stepped, 60);
}

// Theorem 9(a) on trajectories of implicit Euler, from states on and off the boundary.
TEST(IndexOneTest, TrajectoriesStayWithinTheShortTimeBounds) {
  LcpGenerator generator(24);
  int moved = 0;
  for (int k = 0; k < 30; ++k) {
    const IndexOneSystem system = RandomSystem(generator, 3, 2);
    const ShortTimeBounds bounds = ComputeShortTimeBounds(system, 1);
    if (!(bounds.sigma.value > 0)) continue;
    ASSERT_GT(bounds.epsilon1, 0);
    Vector x0 = generator.GaussianVector(3);
    x0 += system.C.transpose() * (system.C * system.C.transpose()).inverse() * (-(system.C * x0)).cwiseMax(0);
    const double h = bounds.epsilon1 / 50;
    const Matrix resolvent = (Matrix::Identity(3, 3) - h * system.A).inverse();
    Vector x = x0, v = Vector::Zero(2);
    for (int step = 0; step < 50; ++step) {
      const auto lcp = SolveLcp(h * system.C * resolvent * system.B, system.C * resolvent * x, SolutionRule::kAuto);
      ASSERT_TRUE(lcp.ok());
      ASSERT_EQ(lcp->verdict, LcpStatus::kSolved);
      x = (resolvent * (x + h * system.B * lcp->y)).eval();
      v += h * lcp->y;
      EXPECT_LE(MaxAbs(v), bounds.sigma2 * MaxAbs(x0));
      EXPECT_LE(MaxAbs(x), bounds.sigma1 * MaxAbs(x0));
    }
    moved += MaxAbs(v) > 0 ? 1 : 0;
  }
  EXPECT_GT(moved, 5);
}

TEST(IndexOneTest, PhiOfLemmaEightStaysBelowItsBound) {
  LcpGenerator generator(23);
  for (int k = 0; k < 30; ++k) {
    const IndexOneSystem system = RandomSystem(generator, 3, 2);
    const double t = generator.Uniform(0.05, 0.5);
    const int pieces = 64;  // u constant on pieces: every integral in closed form
    Vector v = Vector::Zero(2), x = Vector::Zero(3);
    const PhiFunctions phi = ComputePhiFunctions(t / pieces * system.A);
    for (int piece = 0; piece < pieces; ++piece) {
      const Vector u = OnTheUnitCube(generator, 2);
      x = (phi.phi0 * x + t / pieces * phi.phi1 * system.B * u).eval();
      v += t / pieces * u;
    }
    const Vector value = system.C * x - system.C * system.B * v;  // Φ(t, u) of (12)
    EXPECT_LE(MaxAbs(value), PhiBound(system, t) * MaxAbs(v));
    const double A = InfinityNorm(system.A);
    EXPECT_LE(PhiBound(system, t),
              t * InfinityNorm(system.C) * A * InfinityNorm(system.B) * std::exp(A * t) * (1 + 1e-12));
  }
}

// The counterexample to one ε_2 for every x0: (δ, 1) leaves x1 >= 0 at t = δ.
TEST(IndexOneTest, EpsilonOneIsTheTimeOfThePhiBound) {
  LcpGenerator generator(31);
  int inside = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const IndexOneSystem system = RandomSystem(generator, 2 + trial % 5, 2);
    const ShortTimeBounds bounds = ComputeShortTimeBounds(system, 10);
    if (!(bounds.sigma.value > 0)) continue;
    const double kept = bounds.sigma.value / 2;
    EXPECT_LE(PhiBound(system, bounds.epsilon1), kept * (1 + 1e-12)) << trial;
    if (bounds.epsilon1 >= 9.9) continue;
    ++inside;
    EXPECT_GT(PhiBound(system, 1.003 * bounds.epsilon1), kept) << trial;
  }
  EXPECT_GE(inside, 20);
}

TEST(IndexOneTest, BoundsOfAStoppedAnalysisAreSmallerAndTrue) {
  LcpGenerator generator(32);
  std::stop_source source;
  source.request_stop();
  const IndexOneSystem system = RandomSystem(generator, 6, 2);
  const ShortTimeBounds full = ComputeShortTimeBounds(system, 10);
  const ShortTimeBounds stopped = ComputeShortTimeBounds(system, 10, source.get_token());
  ASSERT_GT(full.epsilon1, 0);
  EXPECT_GT(stopped.epsilon1, 0);
  EXPECT_LE(stopped.epsilon1, full.epsilon1);
}

TEST(IndexOneTest, FreeMotionEndsWhereTheStateReachesTheBoundary) {
  const IndexOneSystem system{Matrix{{0, -1}, {0, 0}}, Matrix{{1}, {0}}, Matrix{{1, 0}}};
  for (const double delta : {0.5, 1e-2, 1e-4}) {
    const Vector x0{{delta, 1}};
    const double time = FreeMotionTime(system, x0, TestSemiobservability(system.C, system.A, x0), 1);
    EXPECT_LE(time, delta);
    EXPECT_GE(time, 0.99 * delta);
  }
}

TEST(IndexOneTest, FreeMotionFromTheBoundaryRunsUntilItsReturn) {
  const IndexOneSystem system{Matrix{{0, 1}, {-1, 0}}, Matrix{{1}, {0}}, Matrix{{1, 0}}};  // x1 = sin t
  const Vector x0{{0, 1}};
  const double time = FreeMotionTime(system, x0, TestSemiobservability(system.C, system.A, x0), 10);
  EXPECT_LE(time, M_PI);
  EXPECT_GE(time, 0.99 * M_PI);
}

TEST(IndexOneSectionTest, SaysOfExampleTenThatUniquenessIsNotGuaranteed) {
  const AnalysisSection section = IndexOneSection(ProblemOf(testing::ExampleTenSystem(), Vector{{0, 0, 0, 1}}));
  EXPECT_TRUE(FindingOf(section, "nb-type-one").fact.yes());
  EXPECT_TRUE(FindingOf(section, "solution-exists").fact.yes());
  EXPECT_TRUE(FindingOf(section, "semiobservable").fact.no());
  EXPECT_EQ(FindingOf(section, "short-time-unique").fact.answer, Answer::kUnknown);
  ASSERT_EQ(section.warnings.size(), 1u);
  EXPECT_NE(section.warnings[0].find("may not be unique"), std::string::npos);
}

TEST(IndexOneSectionTest, CertifiesTheFreeMotionInsideTheCone) {
  const AnalysisSection section = IndexOneSection(ProblemOf(testing::ExampleTenSystem(), Vector{{0, 0, 0, -1}}));
  EXPECT_TRUE(FindingOf(section, "short-time-unique").fact.yes());
  EXPECT_TRUE(section.warnings.empty());
  EXPECT_EQ(section.constants.back().value, 1.0);  // for the whole horizon
}

TEST(IndexOneSectionTest, KnowsCorollaryTwoAndWhereItEnds) {
  IndexOneSystem system = testing::ExampleTenSystem();
  system.A = -3 * Matrix::Identity(4, 4);
  Problem problem = ProblemOf(system, Vector{{1, 0, 2, 5}});
  EXPECT_TRUE(FindingOf(IndexOneSection(problem), "scalar-a").fact.yes());
  EXPECT_TRUE(FindingOf(IndexOneSection(ProblemOf(system, Vector{{0, 0, 0, 5}})), "free-on-horizon").fact.yes());
  problem.g = TimeFunction::Constant(Vector{{0, 1, 0}});
  EXPECT_EQ(FindingOf(IndexOneSection(problem), "scalar-a").fact.answer, Answer::kUnknown);
  EXPECT_EQ(FindingOf(IndexOneSection(problem), "solution-exists").fact.answer, Answer::kUnknown);
}

TEST(IndexOneSectionTest, IsPartOfTheAnalysisAndARowOutOfReachIsNamed) {
  IndexOneSystem system = testing::ExampleTenSystem();
  system.B.row(1).setZero();
  const auto analysis = Analyze(ProblemOf(system, Vector{{1, 1, 1, 0}}), Options{}, {});
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  ASSERT_FALSE(analysis->sections.empty());
  const bool warned = std::any_of(analysis->warnings.begin(), analysis->warnings.end(), [](const std::string& warning) {
    return warning.find("y never affects constraint 1:") != std::string::npos;
  });
  EXPECT_TRUE(warned);
}

// (9) is the LCP of implicit Euler, whose matrix M^h is h C(I - hA)⁻¹B for M = 0.
TEST(IndexOneTest, SchemeNineIsImplicitEuler) {
  const IndexOneSystem system = testing::ExampleTenSystem();
  const double h = 0.125;
  const Matrix printed = h * system.C * (Matrix::Identity(4, 4) - h * system.A).inverse() * system.B;
  const Scheme scheme = ThetaScheme(ProblemOf(system, Vector::Zero(4)), h, 0);
  EXPECT_LE(MaxAbs(system.C * scheme.y_after - printed), 1e-15);
}

}  // namespace
}  // namespace dlcs
