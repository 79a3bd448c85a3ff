// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/newton_step.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "core/linalg/norms.h"
#include "core/stepping/newton_bounds.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::SolveWith;

Options TimeSteppingBy(StepSolver step_solver, Index steps, double theta = 0) {
  Options options;
  options.method = Method::kTimeStepping;
  options.step_solver = step_solver;
  options.num_steps = steps;
  options.theta = theta;
  return options;
}

// The two ways to solve a step end at the same time with the same trajectory.
void ExpectAgreement(const Problem& problem, const Solution& newton, const Options& options) {
  Options by_substitution = options;
  by_substitution.step_solver = StepSolver::kSubstitution;
  const Solution substituted = SolveWith(problem, by_substitution);
  ASSERT_EQ(newton.termination, substituted.termination) << newton.message << substituted.message;
  ASSERT_EQ(newton.times, substituted.times);
  EXPECT_LE(MaxAbs(newton.x - substituted.x), 1e-10 * MaxAbs(substituted.x));
  EXPECT_LE(MaxAbs(problem.B * (newton.y - substituted.y)), 1e-10 * MaxAbs(problem.B * substituted.y));
}

void ExpectAgreement(const Problem& problem, Index steps, double theta) {
  const Options options = TimeSteppingBy(StepSolver::kNewton, steps, theta);
  const Solution newton = SolveWith(problem, options);
  ASSERT_EQ(newton.termination, Termination::kReachedEnd) << newton.message;
  EXPECT_EQ(newton.cost.substituted_steps, 0);
  EXPECT_GE(newton.cost.newton_iterations, 1);
  ExpectAgreement(problem, newton, options);
}

// Every file of tests/cases: either Newton's method is refused, because M makes y no function of x, or it agrees with
// substitution.
TEST(NewtonCasesTest, EveryCaseAgreesWithSubstitutionOrIsRefusedWithItsReason) {
  int agreed = 0, refused = 0;
  for (const std::string& name : testing::CaseNames()) {
    SCOPED_TRACE(name);
    const Problem problem = testing::LoadCase(name).problem;
    for (const double theta : {0.0, 0.5}) {
      const Options options = TimeSteppingBy(StepSolver::kNewton, 4000, theta);
      const Solution newton = SolveWith(problem, options);
      if (newton.termination == Termination::kUnsupported) {
        const auto rule = SelectRule(problem.rule, Classify(problem.M));
        ASSERT_TRUE(rule.ok());
        EXPECT_FALSE(IsAlwaysLipschitz(*rule));
        if (newton.message.find("Newton's method (3.3) needs y to be a Lipschitz function of x") == std::string::npos) {
          Options substituted = options;
          substituted.step_solver = StepSolver::kSubstitution;
          EXPECT_EQ(SolveWith(problem, substituted).message, newton.message) << "refused for any method";
        }
        EXPECT_NE(newton.message, "");
        ++refused;
        continue;
      }
      EXPECT_EQ(newton.cost.substituted_steps, 0);
      EXPECT_GE(newton.cost.newton_iterations, 1);
      ExpectAgreement(problem, newton, options);
      ++agreed;
    }
  }
  EXPECT_GE(agreed, 2 * 9);
  EXPECT_EQ(agreed + refused, 2 * static_cast<int>(testing::CaseNames().size()));
}

TEST(NewtonStepTest, AgreesWithSubstitutionOnTheExamplesOfThePapers) {
  for (const double theta : {0.0, 0.5, 1.0}) {
    ExpectAgreement(testing::ExampleFourOne(), 500, theta);
    ExpectAgreement(testing::FourVariableEasy(), 1000, theta);
  }
}

TEST(NewtonStepTest, ReproducesTheJacobianOfExampleFourOne) {
  const Problem problem = testing::ExampleFourOne();
  const double h = 1.0 / 25;  // < 1/(3κ) = 1/24
  const Matrix I = Matrix::Identity(2, 2);
  const Matrix R_inverse = I - h * problem.A.Dense();
  // y1 > 0 where x1 > 0: V = I - h diag(-α1 - α3, -α2) as printed; the same with y4 where x1 < 0.
  const Matrix printed = I - h * Vector{{-4, -2}}.asDiagonal().toDenseMatrix();
  for (const Index active : {0, 3}) {
    const Matrix V = R_inverse * NewtonMatrix(problem, ThetaScheme(problem, h, 0).y_after, {active});
    EXPECT_LT(MaxAbs(V - printed), 1e-15) << active;
  }
  const Matrix at_kink = R_inverse * NewtonMatrix(problem, ThetaScheme(problem, h, 0).y_after, {});
  EXPECT_LT(MaxAbs(at_kink - (I - h * problem.A.Dense())), 1e-15);
}

TEST(NewtonStepTest, ConvergesToTheClosedFormOfExampleFourOneWithOrderOne) {
  const Problem problem = testing::ExampleFourOne();
  double last = 0;
  for (const Index steps : {25, 100, 400, 1600}) {
    const Solution solution = SolveWith(problem, TimeSteppingBy(StepSolver::kNewton, steps));
    double error = 0;
    for (std::size_t k = 0; k < solution.times.size(); ++k) {
      const auto x = solution.x.col(static_cast<Index>(k));
      error = std::max(error, MaxAbs(x - testing::ExampleFourOneExact(solution.times[k])));
    }
    EXPECT_TRUE(solution.warnings.empty()) << solution.warnings.front();
    EXPECT_EQ(solution.cost.substituted_steps, 0);
    if (steps > 100) {
      EXPECT_NEAR(std::log2(last / error) / 2, 1, 0.1) << steps;
    }
    last = error;
  }
}

// x' = -2x - 10 - Σ b_i y_i, y_i = (x - k_i)⁺, from x = 1: the first step of length 1/10 ends at 0 and crosses all the
// kinks k_i = 4^{-i} that crowd there.
Problem CrowdedKinks() {
  constexpr Index n = 20;
  Problem problem;
  problem.A = Matrix::Constant(1, 1, -2);
  problem.B.MutableDense().resize(1, n);
  Vector kinks(n);
  for (Index i = 0; i < n; ++i) {
    problem.B(0, i) = -std::pow(2.0, -static_cast<double>(i));
    kinks[i] = std::pow(4.0, -static_cast<double>(i + 1));
  }
  problem.B.MutableDense() /= problem.B.Dense().cwiseAbs().sum();  // κ = 2 + 1
  problem.N = -Matrix::Ones(n, 1);
  problem.M = Matrix::Identity(n, n);
  problem.f = TimeFunction::Constant(Vector::Constant(1, -10));
  problem.g = TimeFunction::Constant(kinks);
  problem.x0 = Vector::Ones(1);
  problem.horizon = 0.1;
  return problem;
}

// ‖H(u^{k+1}) - H(u^k)‖ / ‖u^{k+1} - u^k‖ of u^{k+1} = H(u^k), (3.1), at θ = 0 and for constant sources.
std::vector<double> ContractionQuotients(const Problem& problem, double h, int count) {
  const auto constant = [](const TimeFunction& function) {
    return std::get<ConstantFunction>(function.pieces.front().function).value;
  };
  const Vector f = constant(problem.f), g = constant(problem.g);
  const auto solver = MakeLcpSolver(problem.M, Selection::kUnique);
  Basis basis(problem.num_constraints(), 0);
  const Vector tolerance = Vector::Constant(problem.num_constraints(), 1e-14);
  const auto H = [&](const Vector& u) -> Vector {
    Vector y(problem.num_constraints());
    EXPECT_EQ(solver->Solve(problem.N * u + g, tolerance, basis, y), LcpStatus::kSolved);
    return problem.x0 + h * (problem.A * u + problem.B * y + f);
  };
  std::vector<double> quotients;
  Vector u = problem.x0;
  Vector next = H(u);
  for (int k = 0; k < count; ++k) {
    const Vector after = H(next);
    quotients.push_back(MaxAbs(after - next) / MaxAbs(next - u));
    u = next;
    next = after;
  }
  return quotients;
}

TEST(NewtonStepTest, ConvergesSuperlinearlyWhereTheContractionIsLinear) {
  const Problem problem = CrowdedKinks();
  const Solution solution = SolveWith(problem, TimeSteppingBy(StepSolver::kNewton, 1));
  ASSERT_TRUE(solution.newton && solution.newton->contraction);
  EXPECT_DOUBLE_EQ(*solution.newton->contraction, 0.3);  // hκ < 1/3
  EXPECT_TRUE(solution.warnings.empty());
  const std::vector<double>& residuals = solution.newton->residuals;
  EXPECT_EQ(solution.newton->time, problem.horizon);
  EXPECT_EQ(solution.cost.most_newton_iterations, static_cast<Index>(residuals.size()) - 1);
  ASSERT_GE(residuals.size(), 5u);
  EXPECT_EQ(residuals.back(), 0);
  const std::vector<double> quotients = solution.newton->Quotients();
  ASSERT_EQ(quotients.size() + 1, residuals.size());
  double last = 1;
  for (std::size_t k = 0; k < quotients.size(); ++k) {
    EXPECT_EQ(quotients[k], residuals[k + 1] / residuals[k]);
    EXPECT_LT(quotients[k], last) << k;
    last = quotients[k];
  }
  for (const double quotient : ContractionQuotients(problem, problem.horizon, 12)) {
    EXPECT_LE(quotient, 0.3 + 1e-9);
    EXPECT_GE(quotient, 0.2 - 1e-9);
  }
}

// F of a step at θ = 0 and h = 0.1, with y the unique solution.
class StepFunction {
 public:
  StepFunction(const Problem& problem, Vector g)
      : problem_(problem),
        g_(std::move(g)),
        y_after_(ThetaScheme(problem, 0.1, 0).y_after),
        solver_(MakeLcpSolver(problem.M, Selection::kUnique)) {}

  const Matrix& y_after() const { return y_after_; }

  Vector operator()(const Vector& u) const {
    Basis basis(g_.size(), 0);
    Vector y(g_.size());
    EXPECT_EQ(solver_->Solve(problem_.N * u + g_, Vector::Constant(g_.size(), 1e-15), basis, y), LcpStatus::kSolved);
    return u - y_after_ * y;
  }

  Matrix DerivativeAt(const Vector& u, double eps) const {
    Matrix derivative(u.size(), u.size());
    for (Index j = 0; j < u.size(); ++j) {
      const Vector e = Vector::Unit(u.size(), j) * eps;
      derivative.col(j) = ((*this)(u + e) - (*this)(u - e)) / (2 * eps);
    }
    return derivative;
  }

 private:
  const Problem& problem_;
  Vector g_;
  Matrix y_after_;
  std::unique_ptr<LcpSolver> solver_;
};

Problem RandomPProblem(Index m, Index n) {
  Problem problem;
  problem.A = Matrix::Random(m, m);
  problem.B = Matrix::Random(m, n);
  problem.N = Matrix::Random(n, m);
  problem.M = Matrix::Random(n, n);
  problem.M.MutableDense().diagonal().array() += static_cast<double>(n);  // a P-matrix
  return problem;
}

// At a point where y has a kink, V is the derivative of F at points as near as one likes: it is in ∂F. Theorem 3.1,
// Case 1: N has full row rank, so that u can be moved where (I - D)(q(u) - q) > 0.
TEST(NewtonStepTest, MatrixIsALimitOfDerivatives) {
  std::srand(5);
  constexpr Index n = 4, m = 5;
  for (int trial = 0; trial < 50; ++trial) {
    const Problem problem = RandomPProblem(m, n);
    // y = (+, +, 0, 0), w = (0, 0, 0, +): index 2 is degenerate.
    const Vector y{{1, 2, 0, 0}}, w{{0, 0, 0, 1}};
    const Vector u = Vector::Random(m);
    const StepFunction F(problem, w - problem.M * y - problem.N * u);
    const Matrix V = NewtonMatrix(problem, F.y_after(), {0, 1});
    const Vector into_the_piece =
        problem.N.Dense().completeOrthogonalDecomposition().solve(Vector{{0, 0, 1, 1}});  // (I - D)e
    for (const double distance : {1e-2, 1e-4}) {
      EXPECT_LT(MaxAbs(F.DerivativeAt(u + distance * into_the_piece, distance * 1e-3) - V), 1e-8)
          << trial << " at " << distance;
    }
  }
}

// Theorem 3.1, Case 2: without full row rank no u need move (q_i)_{i not in J} upwards. The proof then changes N,
// N_ℓ -> N with full row rank: V is the limit of matrices V_ℓ of ∂F_ℓ. That makes it a limit of derivatives of other
// functions F_ℓ.
TEST(NewtonStepTest, MatrixIsALimitOfDerivativesForNearbyNWithoutFullRowRank) {
  std::srand(6);
  for (const Index n : {4, 7}) {  // 7 > m: rank(N) <= m < n, the augmented case
    constexpr Index m = 5;
    for (int trial = 0; trial < 20; ++trial) {
      Problem problem = RandomPProblem(m, n);
      problem.N.MutableDense().row(2) = problem.N.Dense().row(3);
      Vector y = Vector::Zero(n), w = Vector::Zero(n);
      y.head(2) << 1, 2;  // 2 and 3 are degenerate
      w.tail(n - 4).setOnes();
      const Vector u = Vector::Random(m);
      const Vector g = w - problem.M * y - problem.N * u;
      const Matrix V = NewtonMatrix(problem, StepFunction(problem, g).y_after(), {0, 1});
      for (const double eta : {1e-3, 1e-5}) {
        // Rows 2 and 3 of N_ℓ differ: q_2 and q_3 can both be raised, with q_0 and q_1 as they are.
        Problem nearby = problem;
        nearby.N.MutableDense().row(2) += eta * Vector::Random(m).transpose();
        const StepFunction F(nearby, g + (problem.N.Dense() - nearby.N.Dense()) * u);
        const Vector into_the_piece =
            nearby.N.Dense().topRows(4).completeOrthogonalDecomposition().solve(Vector{{0, 0, 1, 1}});
        const double distance = 1e-3 / (1 + MaxAbs(into_the_piece));
        const Matrix derivative = F.DerivativeAt(u + distance * into_the_piece, distance * 0.01);
        EXPECT_LT(MaxAbs(derivative - V), 10 * eta) << trial << " n = " << n;
      }
    }
  }
}

// With q = (u, -u) no u makes both components larger: where J is empty V = I is the derivative of F nowhere near u = 0,
// and not in ∂F: F(u) = u - u⁻/4 + u⁺/2 has ∂F(0) = [5/4, 3/2]. Theorem 3.1 is false as printed; Theorem 3.2 holds
// without it.
TEST(NewtonStepTest, MatrixNeedNotBeAGeneralizedJacobianWithoutFullRowRank) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = Matrix{{2.5, -5}};
  problem.N = Matrix{{1}, {-1}};
  problem.M = Matrix::Identity(2, 2);
  const StepFunction F(problem, Vector::Zero(2));
  const Matrix V = NewtonMatrix(problem, F.y_after(), {});
  EXPECT_EQ(V(0, 0), 1);
  for (const double distance : {1e-2, 1e-6}) {
    for (const double u : {-distance, distance}) {
      const double slope = F.DerivativeAt(Vector::Constant(1, u), distance * 1e-3)(0, 0);
      EXPECT_NEAR(slope, u < 0 ? 1.25 : 1.5, 1e-9);
    }
  }
}

TEST(NewtonStepTest, SolvesACycleBySubstitutionAndSaysSo) {
  // F(u) = u - p + hb[u⁺ - (u - 1)⁺] has slopes 1, 3, 1: with p = 1.5 and hb = 2 the iterates are 1.5, -0.5, 1.5, ...
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = Matrix{{-2, 2}};
  problem.N = Matrix{{-1}, {-1}};
  problem.M = Matrix::Identity(2, 2);
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{0, 1}});
  problem.x0 = Vector::Constant(1, 1.5);
  problem.horizon = 1;
  const Solution solution = SolveWith(problem, TimeSteppingBy(StepSolver::kNewton, 1));
  EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_EQ(solution.cost.substituted_steps, 1);
  ASSERT_EQ(solution.warnings.size(), 2u);
  EXPECT_NE(solution.warnings[0].find("not guaranteed"), std::string::npos);
  EXPECT_NE(solution.warnings[1].find("by substitution"), std::string::npos);
  EXPECT_NEAR(solution.x(0, 1), 0.5, 1e-14);
}

TEST(NewtonStepTest, IsRefusedWhereYIsNoFunctionOfX) {
  for (const char* name : {"relay_sliding", "diode_bridge", "american_put"}) {
    const Solution solution = SolveWith(testing::LoadCase(name).problem, TimeSteppingBy(StepSolver::kNewton, 100));
    EXPECT_EQ(solution.termination, Termination::kUnsupported) << name;
    EXPECT_NE(solution.message.find("Newton"), std::string::npos) << solution.message;
  }
}

}  // namespace
}  // namespace dlcs
