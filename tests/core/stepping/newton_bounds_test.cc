// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/newton_bounds.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/analysis/interior_point.h"
#include "core/analysis/time_stepping_section.h"
#include "core/context/solve_context.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/lipschitz.h"
#include "core/solve.h"
#include "core/stepping/newton_step.h"
#include "tests/support/lcp_problems.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

constexpr Selection kLeast = Selection::kLeastElement;

double Kappa(const Problem& problem) { return *RightHandSideLipschitz(problem, LipschitzConstant(problem.M)); }

GuaranteedInterval IntervalOf(const Problem& problem) {
  const auto interval = GuaranteeInterval(problem, kLeast, Kappa(problem));
  EXPECT_TRUE(interval.ok() && interval->has_value());
  return **interval;
}

Solution SolveByNewton(const Problem& problem, double step) {
  Options options;
  options.method = Method::kTimeStepping;
  options.step_solver = StepSolver::kNewton;
  options.step = step;
  return testing::SolveWith(problem, options);
}

bool IsSolvable(const Problem& problem, const Vector& q) {
  Basis basis(q.size(), 0);
  Vector y(q.size());
  return MakeLcpSolver(problem.M, kLeast)->Solve(q, Vector::Constant(q.size(), 1e-13), basis, y) == LcpStatus::kSolved;
}

Vector ConstantOf(const TimeFunction& function) {
  return std::get<ConstantFunction>(function.pieces.front().function).value;
}

// A Z-matrix that is no P-matrix, and constant sources with an interior point at x0: (4.1).
Problem RandomLeastElementProblem(LcpGenerator& generator) {
  constexpr Index m = 3, n = 4;
  Problem problem;
  problem.A = generator.Gaussian(m, m);
  problem.B = generator.Gaussian(m, n);
  problem.N = generator.Gaussian(n, m);
  problem.M = -generator.Gaussian(n, n).cwiseAbs();
  for (Index i = 1; i < n; ++i) problem.M(i, i) = generator.Uniform(0, 2);
  problem.x0 = generator.GaussianVector(m);
  const Vector v = generator.GaussianVector(n).cwiseAbs();
  problem.f = TimeFunction::Constant(generator.GaussianVector(m));
  problem.g = TimeFunction::Constant(generator.GaussianVector(n).cwiseAbs() - problem.M * v - problem.N * problem.x0);
  problem.horizon = 1;
  return problem;
}

TEST(NewtonBoundsTest, ExampleFourOneHasThePrintedConstants) {
  const Problem problem = testing::ExampleFourOne();
  EXPECT_EQ(LipschitzConstant(problem.M), 1);
  EXPECT_EQ(Kappa(problem), 8);
  LcpGenerator generator(1);
  for (int k = 0; k < 20; ++k) {
    Problem other = problem;
    const Vector a = generator.GaussianVector(4);
    other.A = Matrix(Vector(-a.head(2)).asDiagonal());
    other.B.MutableDense() << -a[2], 0, 0, a[2], 0, a[3], a[3], 0;
    EXPECT_NEAR(Kappa(other), MaxAbs(a.head(2)) + 2 * MaxAbs(a.tail(2)), 1e-14);
  }
}

// x0 = (0, 1): y = 0, so c = ‖(1.2 sin 10h, -2)‖ = 2; LCP(N x, M) is solvable where x2 >= 0.
TEST(NewtonBoundsTest, ExampleFourOneHasBoundsInClosedForm) {
  const Problem problem = testing::ExampleFourOne();
  const auto first = BoundFirstStep(problem, kLeast, 8, 0.01);
  ASSERT_TRUE(first.ok() && first->has_value());
  EXPECT_DOUBLE_EQ((*first)->speed, 2);
  EXPECT_DOUBLE_EQ(*(*first)->gamma, 0.02 / 0.92);
  EXPECT_DOUBLE_EQ(*(*first)->gamma_1, 0.02 / 0.76);
  EXPECT_NEAR(*(*first)->room, 1, 1e-9);
  EXPECT_TRUE((*first)->newton_is_sure());
  const auto long_step = BoundFirstStep(problem, kLeast, 8, 0.1);
  ASSERT_TRUE(long_step.ok() && long_step->has_value());
  EXPECT_TRUE((*long_step)->gamma);
  EXPECT_FALSE((*long_step)->gamma_1);

  const GuaranteedInterval interval = IntervalOf(problem);
  EXPECT_NEAR(interval.gamma, 1, 1e-9);
  EXPECT_DOUBLE_EQ(interval.speed, 2);
  EXPECT_NEAR(interval.interval, 0.1, 1e-9);  // γ/(c_0 + κγ) = 1/(2 + 8)
  EXPECT_TRUE(interval.sampled);
}

// x' = 3 + y, 0 <= y ⟂ x + 1 - 2t - y >= 0 from 0: γ = 1 - 2T, c_0 = 3, κ = 1, so T_0 = (1 - 2T_0)/(4 - 2T_0).
TEST(NewtonBoundsTest, WeighsTheDriftOfGAgainstTheTimeThatItLeaves) {
  Problem problem = testing::Scalar(0, 0, 0, 5);
  problem.M(0, 0) = -1;
  problem.f = TimeFunction::Constant(Vector::Constant(1, 3));
  problem.g = TimeFunction::Formulas({"1 - 2*t"});
  const double exact = (6 - std::sqrt(28.0)) / 4;  // 2T² - 6T + 1 = 0
  const GuaranteedInterval interval = IntervalOf(problem);
  EXPECT_LE(interval.interval, exact);
  EXPECT_GT(interval.interval, exact - 0.25 / 128);
  EXPECT_NEAR(interval.gamma, 1 - 2 * interval.horizon, 1e-8);
}

// Theorem 4.1 (i).
TEST(NewtonBoundsTest, PerturbationsInTheBallStaySolvable) {
  LcpGenerator generator(2);
  for (int trial = 0; trial < 50; ++trial) {
    const Problem problem = RandomLeastElementProblem(generator);
    const GuaranteedInterval interval = IntervalOf(problem);
    ASSERT_GT(interval.gamma, 0);
    const Vector g = ConstantOf(problem.g);
    for (int k = 0; k < 20; ++k) {
      Vector z(problem.num_states());
      for (double& entry : z) entry = k % 2 ? generator.Uniform(-1, 1) : std::copysign(1, generator.Uniform(-1, 1));
      EXPECT_TRUE(IsSolvable(problem, problem.N * (problem.x0 + (1 - 1e-9) * interval.gamma * z) + g)) << trial;
    }
    // γ cannot be larger for all N of this norm: the worst q of the larger ball has no solution.
    const double rho = interval.gamma * InfinityNorm(problem.N);
    EXPECT_FALSE(IsSolvable(problem, ((problem.N * problem.x0 + g).array() - 1.0001 * rho).matrix())) << trial;
  }
}

// The iterates u^0, u^1, ... of (3.3) as printed, by a loop of its own; θ = 0.
std::vector<Vector> NewtonIterates(const Problem& problem, double h, const Vector& start, const Vector& f,
                                   const Vector& g) {
  const Index m = problem.num_states(), n = problem.num_constraints();
  const auto solver = MakeLcpSolver(problem.M, kLeast);
  std::vector<Vector> iterates = {start};
  for (int k = 0; k < 20; ++k) {
    const Vector& u = iterates.back();
    Basis basis(n, 0);
    Vector y(n);
    const Vector q = problem.N * u + g;
    EXPECT_EQ(solver->Solve(q, Vector::Constant(n, 1e-14 * (1 + MaxAbs(q))), basis, y), LcpStatus::kSolved);
    const Vector F = u - start - h * (problem.A * u + problem.B * y + f);
    if (MaxAbs(F) <= 1e-14 * (1 + MaxAbs(u))) break;
    const Matrix D = (y.array() > 0).cast<double>().matrix().asDiagonal();
    const Matrix inner = Matrix::Identity(n, n) - D + D * problem.M.Dense();
    const Matrix V =
        Matrix::Identity(m, m) - h * (problem.A.Dense() - problem.B.Dense() * inner.lu().solve(D * problem.N.Dense()));
    iterates.push_back(u - V.lu().solve(F));
  }
  return iterates;
}

// Theorem 3.2 and (3.6), with the rate that takes the place of the printed argument: the step is as long as allowed.
TEST(NewtonBoundsTest, IteratesStayInTheBallAndContract) {
  LcpGenerator generator(3);
  int sure = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Problem problem = RandomLeastElementProblem(generator);
    const double kappa = Kappa(problem), h = (trial % 2 ? 0.1 : 0.02) / kappa;
    const auto first = BoundFirstStep(problem, kLeast, kappa, h);
    ASSERT_TRUE(first.ok() && first->has_value());
    if (!(*first)->newton_is_sure()) continue;
    ++sure;
    const auto iterates = NewtonIterates(problem, h, problem.x0, ConstantOf(problem.f), ConstantOf(problem.g));
    const Vector& limit = iterates.back();
    EXPECT_LE(MaxAbs(limit - problem.x0), *(*first)->gamma * (1 + 1e-12)) << trial;
    for (std::size_t k = 0; k + 1 < iterates.size(); ++k) {
      EXPECT_LE(MaxAbs(iterates[k] - problem.x0), *(*first)->gamma_1 * (1 + 1e-12)) << trial;
      EXPECT_LE(MaxAbs(iterates[k + 1] - limit), 2 * h * kappa / (1 - h * kappa) * MaxAbs(iterates[k] - limit) + 1e-13)
          << trial;
    }
  }
  EXPECT_GE(sure, 50);
}

// Theorem 4.1 (ii), (iii): on [0, T_0] with h < 1/(3κ).
TEST(NewtonBoundsTest, SolvesByNewtonOnTheGuaranteedInterval) {
  LcpGenerator generator(4);
  for (int trial = 0; trial < 100; ++trial) {
    Problem problem = trial == 0   ? testing::ExampleFourOne()
                      : trial == 1 ? testing::FourVariableEasy()
                                   : RandomLeastElementProblem(generator);
    const GuaranteedInterval interval = IntervalOf(problem);
    problem.horizon = interval.interval;
    const double kappa = Kappa(problem);
    const Solution solution = SolveByNewton(problem, std::min(0.3 / kappa, problem.horizon / 10));
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << trial << ": " << solution.message;
    EXPECT_EQ(solution.cost.substituted_steps, 0) << trial;
    EXPECT_TRUE(solution.warnings.empty()) << trial << ": " << solution.warnings.front();
    EXPECT_LE(MaxAbs(solution.x.colwise() - problem.x0), interval.gamma) << trial;
    // (4.4): successive approximation over the whole interval converges, to the same solution.
    Options options;
    options.method = Method::kLaplaceIteration;
    options.window_steps = Options::kWholeHorizon;
    options.num_steps = solution.x.cols() - 1;
    Observer silent;
    const auto iterated = Solve(problem, options, silent, {});
    ASSERT_TRUE(iterated.ok());
    ASSERT_EQ(iterated->termination, Termination::kReachedEnd) << trial << ": " << iterated->message;
    EXPECT_EQ(iterated->cost.windows, 1);
    EXPECT_LT(MaxAbs(iterated->x - solution.x), 0.1 * interval.gamma) << trial;
  }
}

// As printed, (iii) of Theorem 4.1 asks h < 1/(3κ) alone. Here 3hκ = 0.9 and (4.1) holds, but the first iterate u = 1
// is beyond 0.9, where LCP(N u + g, M) has no solution: γ_1 must lie in the feasible ball, as Lemma 3.1 assumes.
TEST(NewtonBoundsTest, ShortStepsAreNotEnoughAtTheEdgeOfTheFeasibleStates) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = Matrix{{-0.3, 0}};
  problem.N = Matrix{{-1}, {-1}};
  problem.M = Matrix(Vector{{1, -1}}.asDiagonal());
  problem.f = TimeFunction::Constant(Vector::Ones(1));
  problem.g = TimeFunction::Constant(Vector{{0, 0.9}});
  problem.x0 = Vector::Zero(1);
  problem.horizon = 1;
  EXPECT_DOUBLE_EQ(Kappa(problem), 0.3);
  EXPECT_TRUE(TestInteriorPoint(ConstantOf(problem.g), problem.M).yes());
  const auto first = BoundFirstStep(problem, kLeast, 0.3, 1);
  ASSERT_TRUE(first.ok() && first->has_value());
  EXPECT_NEAR(*(*first)->gamma_1, 10, 1e-12);
  EXPECT_NEAR(*(*first)->room, 0.9, 1e-12);
  EXPECT_FALSE((*first)->newton_is_sure());

  const Solution solution = SolveByNewton(problem, 1);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_EQ(solution.cost.substituted_steps, 1);
  EXPECT_NEAR(solution.x(0, 1), 1 / 1.3, 1e-14);  // the step has its solution all the same
}

TEST(NewtonBoundsTest, InteriorPointsComeWithTheirProof) {
  LcpGenerator generator(5);
  int yes = 0, no = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Index n = 1 + trial % 6;
    const Matrix M = generator.Gaussian(n, n) - generator.Uniform(0, 2) * Matrix::Ones(n, n);
    const Vector q = generator.GaussianVector(n);
    const Fact fact = TestInteriorPoint(q, M);
    const Vector& z = fact.witness.z;
    ASSERT_EQ(z.size(), n) << trial << fact.why;
    if (fact.yes()) {
      ++yes;
      EXPECT_TRUE((z.array() > 0).all() && ((q + M * z).array() > 0).all()) << trial;
    } else {
      ASSERT_TRUE(fact.no()) << trial << fact.why;
      ++no;
      EXPECT_TRUE((z.array() >= 0).all() && z.sum() > 0.5) << trial;
      EXPECT_LT((M.transpose() * z).maxCoeff(), 1e-13) << trial;
      EXPECT_LT(q.dot(z), 1e-13) << trial;
    }
  }
  EXPECT_GT(yes, 100);
  EXPECT_GT(no, 100);
  // At the edge of the feasible states: x2 = 0 in Example 4.1.
  const Problem problem = testing::ExampleFourOne();
  EXPECT_TRUE(TestInteriorPoint(problem.N * problem.x0, problem.M).yes());
  EXPECT_TRUE(TestInteriorPoint(Vector::Zero(4), problem.M).no());
}

AnalysisSection SectionFor(const Problem& problem, double step, StepSolver step_solver = StepSolver::kNewton) {
  Options options;
  options.method = Method::kTimeStepping;
  options.step_solver = step_solver;
  options.step = step;
  const MatrixClass matrix_class = Classify(problem.M);
  return TimeSteppingSection(problem, options, matrix_class, *SelectRule(problem.rule, matrix_class));
}

std::optional<double> ValueOf(const AnalysisSection& section, const std::string& id) {
  for (const Constant& constant : section.constants) {
    if (constant.id != id) continue;
    EXPECT_TRUE(constant.value || !constant.why.empty()) << id << " is absent without a reason";
    return constant.value;
  }
  ADD_FAILURE() << id;
  return std::nullopt;
}

TEST(TimeSteppingSectionTest, TellsTheConstantsOfExampleFourOne) {
  const AnalysisSection section = SectionFor(testing::ExampleFourOne(), 0.01);
  EXPECT_EQ(ValueOf(section, "kappa"), 8);
  EXPECT_EQ(ValueOf(section, "contraction-step"), 1.0 / 8);
  EXPECT_EQ(ValueOf(section, "newton-bound"), 1.0 / 24);
  EXPECT_NEAR(*ValueOf(section, "gamma"), 0.02 / 0.92, 1e-15);
  EXPECT_NEAR(*ValueOf(section, "gamma-1"), 0.02 / 0.76, 1e-15);
  EXPECT_NEAR(*ValueOf(section, "t-0"), 0.1, 1e-9);
  EXPECT_TRUE(section.findings.at(0).fact.yes());  // (4.1)
  EXPECT_TRUE(section.findings.at(1).fact.yes());  // the step
  EXPECT_TRUE(section.warnings.empty());
}

TEST(TimeSteppingSectionTest, AllowsALongStepAndSaysThatItIsUnguaranteed) {
  const Problem problem = testing::ExampleFourOne();
  const AnalysisSection above = SectionFor(problem, 0.1);
  EXPECT_TRUE(above.findings.at(1).fact.no());
  EXPECT_EQ(ValueOf(above, "gamma-1"), std::nullopt);
  ASSERT_EQ(above.warnings.size(), 1u);
  EXPECT_NE(above.warnings[0].find("1/(3κ) = 0.0416667"), std::string::npos) << above.warnings[0];
  EXPECT_TRUE(SectionFor(problem, 0.1, StepSolver::kSubstitution).warnings.empty());

  const Solution solution = SolveByNewton(problem, 0.1);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd);
  ASSERT_FALSE(solution.warnings.empty());
  EXPECT_NE(solution.warnings[0].find("not guaranteed"), std::string::npos);
  // Below 1/24, but the ball of γ_1 = 2 around x0 leaves the feasible states.
  EXPECT_EQ(SectionFor(problem, 1.0 / 25).findings.at(1).fact.answer, Answer::kUnknown);
}

TEST(TimeSteppingSectionTest, CoversTheHorizonForPMatrices) {
  const AnalysisSection section = SectionFor(testing::Scalar(-1, 0, 1, 7), 0.01);
  EXPECT_EQ(ValueOf(section, "kappa"), 2);
  EXPECT_EQ(ValueOf(section, "t-0"), 7);
  EXPECT_TRUE(section.findings.at(1).fact.yes());
}

TEST(TimeSteppingSectionTest, GivesAReasonForWhatIsAbsent) {
  Problem problem = testing::Scalar(-1, 0, 1, 1);
  problem.M(0, 0) = 0;
  const AnalysisSection section = SectionFor(problem, 0.01);
  for (const Constant& constant : section.constants) {
    EXPECT_FALSE(constant.value) << constant.id;
    EXPECT_NE(constant.why, "") << constant.id;
  }
  EXPECT_TRUE(section.findings.at(0).fact.yes());
  EXPECT_EQ(section.findings.at(1).fact.answer, Answer::kUnknown);
}

}  // namespace
}  // namespace dlcs
