// SPDX-License-Identifier: Apache-2.0
// Random systems of every class, against exp-PL and exp-PC on fine grids: two methods that share no
// discretization.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

enum class Kind { kPositiveDefinite, kIndefiniteP, kMMatrix, kPassiveSkew, kPassiveSingular, kZero };

std::string Wave(LcpGenerator& random) {
  return std::to_string(random.Normal()) + "*sin(" + std::to_string(random.Uniform(1, 9)) + "*t+" +
         std::to_string(random.Uniform(0, 6)) + ")";
}

// Where M does not make y a function of x the system is made passive (N = Bᵀ, A stable), so that it has one
// x.
Problem RandomProblem(LcpGenerator& random, Kind kind) {
  const Index m = random.Integer(2, 5);
  const Index n = random.Integer(1, 4);
  const bool passive = kind == Kind::kPassiveSkew || kind == Kind::kPassiveSingular || kind == Kind::kZero;
  Problem problem;
  const Matrix G = random.Gaussian(m, m);
  problem.A = passive ? Matrix(-G * G.transpose() / static_cast<double>(m) + 2 * random.Skew(m))
                      : Matrix(G - Matrix::Identity(m, m));
  problem.B = random.Gaussian(m, std::min(m, n));
  const Index constraints = problem.B.cols();
  problem.N = passive ? Matrix(problem.B.Dense().transpose()) : random.Gaussian(constraints, m);
  switch (kind) {
    case Kind::kPositiveDefinite:
      problem.M = random.PositiveDefinite(constraints);
      break;
    case Kind::kIndefiniteP:
      problem.M = random.IndefinitePMatrix(constraints);
      break;
    case Kind::kMMatrix:
      problem.M = random.MMatrix(constraints);
      break;
    case Kind::kPassiveSkew:
      problem.M = random.Skew(constraints);
      break;
    case Kind::kPassiveSingular:
      problem.M = random.PositiveSemidefinite(constraints, constraints / 2);
      break;
    case Kind::kZero:
      problem.M = Matrix::Zero(constraints, constraints);
      break;
  }
  problem.x0 = random.GaussianVector(m);
  problem.horizon = 2;
  std::vector<std::string> f, g;
  for (Index i = 0; i < m; ++i) f.push_back(Wave(random));
  for (Index i = 0; i < constraints; ++i) {
    // A wave that starts where the state is consistent, N x0 + g(0) > 0.
    const double level = 0.1 - (problem.N.Dense().row(i) * problem.x0)(0) + std::abs(random.Normal());
    g.push_back(std::to_string(level) + "+0.8*(" + Wave(random) + ")*t");
  }
  problem.f = TimeFunction::Formulas(std::move(f));
  problem.g = TimeFunction::Formulas(std::move(g));
  return problem;
}

struct Comparison {
  Kind kind;
  const char* name;
  Index steps;
  double allowed;  // the error of the march, relative
};
void PrintTo(const Comparison& comparison, std::ostream* out) { *out << comparison.name; }

class EventRandomTest : public ::testing::TestWithParam<Comparison> {};

// Ten times in [0, T].
Solution SolveBy(Method method, const Problem& problem, Options options) {
  options.method = method;
  options.project_initial_state = true;
  for (int k = 1; k <= 10; ++k) options.output_times.push_back(k * problem.horizon / 10);
  options.output_times_only = true;
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}

Solution Locate(const Problem& problem, double tolerance) {
  Options options;
  options.error_tolerance = tolerance;
  return SolveBy(Method::kEventDriven, problem, options);
}

TEST_P(EventRandomTest, AgreesWithAFineMarch) {
  LcpGenerator random(11);
  std::size_t events = 0;
  for (int trial = 0; trial < 12; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const Problem problem = RandomProblem(random, GetParam().kind);
    Options fine;
    fine.num_steps = GetParam().steps;
    fine.estimate_error = true;
    const Solution marched = SolveBy(Method::kExponentialIntegrator, problem, fine);
    ASSERT_EQ(marched.termination, Termination::kReachedEnd) << marched.message;
    const Solution located = Locate(problem, 1e-9);
    ASSERT_EQ(located.termination, Termination::kReachedEnd) << located.message;
    // By as much as the march itself changes when its step is halved.
    const double size = MaxAbs(marched.x);
    EXPECT_LT(MaxAbs(located.x - marched.x), std::max(GetParam().allowed * size, 4 * marched.accuracy.error * size));
    EXPECT_EQ(located.cost.coupled_steps, 0);
    EXPECT_LT(located.certificate.node_residual, 1e-8 * located.certificate.lcp_scale);

    // A thousandth of the tolerance moves the solution by less than the tolerance.
    EXPECT_LT(MaxAbs(located.x - Locate(problem, 1e-12).x), 1e-9 * size);
    events += located.switching_times.size() - 1;
  }
  EXPECT_GT(events, 12u);
}

INSTANTIATE_TEST_SUITE_P(All, EventRandomTest,
                         ::testing::Values(Comparison{Kind::kPositiveDefinite, "PositiveDefinite", 2000, 1e-5},
                                           Comparison{Kind::kIndefiniteP, "IndefiniteP", 2000, 1e-4},
                                           Comparison{Kind::kMMatrix, "MMatrix", 2000, 1e-5},
                                           Comparison{Kind::kPassiveSkew, "PassiveSkew", 4000, 1e-2},
                                           Comparison{Kind::kPassiveSingular, "PassiveSingular", 4000, 1e-2},
                                           Comparison{Kind::kZero, "Zero", 4000, 1e-2}),
                         [](const auto& comparison) { return std::string(comparison.param.name); });

}  // namespace
}  // namespace dlcs
