// SPDX-License-Identifier: Apache-2.0

#include "core/iteration/wu_chen_iteration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/lcp/lcp.h"
#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::SolveToEnd;

Options On(Method method, Index steps, Index nodes = 25) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  options.num_contour_nodes = nodes;
  return options;
}

struct SectorialCase {
  const char* name;
  double horizon;  // short enough for the whole of it to be one window
};
void PrintTo(const SectorialCase& the_case, std::ostream* out) { *out << the_case.name; }

class WuChenIterationTest : public ::testing::TestWithParam<SectorialCase> {};

TEST_P(WuChenIterationTest, AgreesWithLaplaceIterationToTheAccuracyOfItsContour) {
  Problem problem = testing::LoadCase(GetParam().name).problem;
  problem.horizon = GetParam().horizon;
  const Index steps = 50;
  const Solution reference = SolveToEnd(problem, On(Method::kLaplaceIteration, steps));
  const double scale = MaxAbs(reference.x);
  const auto error = [&](Index nodes) {
    const Solution solution = SolveToEnd(problem, On(Method::kWuChenIteration, steps, nodes));
    if (solution.termination != Termination::kReachedEnd) return std::nan("");
    return MaxAbs(solution.x - reference.x) / scale;
  };
  // Error C e^{-2.06 √P}: the logarithm falls by 2.06 per unit of √P, measured from P = 9 to 64 (√P by 5), with an
  // oscillation of the quadrature error that a slope over the whole range averages out.
  const double coarse = error(9), fine = error(64);
  const double rate = std::log(coarse / fine) / 5;
  EXPECT_GT(rate, 1.7) << coarse << " " << fine;
  EXPECT_LT(rate, 3.0) << coarse << " " << fine;
  EXPECT_LT(fine, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Sectorial, WuChenIterationTest,
                         ::testing::Values(SectorialCase{"z_least", 2}, SectorialCase{"formula_zoo", 2},
                                           SectorialCase{"wall_permeable", 0.1}));

TEST(WuChenIterationTest, TakesTheContourOfRemark23ForTheInitialState) {
  Options options = On(Method::kWuChenIteration, 40, 25);
  const Solution exact = SolveToEnd(testing::FourVariableEasy(), options);
  options.contour_for_initial_state = true;
  const Solution contour = SolveToEnd(testing::FourVariableEasy(), options);
  EXPECT_LT(MaxAbs(exact.x - contour.x), 1e-10);
  EXPECT_GT(MaxAbs(exact.x - contour.x), 0);
}

// Remark 2.1: imaginary, unstable and zero eigenvalues, whole and in part outside the sector.
TEST(WuChenIterationTest, ServesSpectraOutsideTheSector) {
  struct Subject {
    const char* name;
    Matrix A;
    Index separated;
  };
  Matrix oscillator(3, 3), unstable(3, 3), spiral(3, 3), nilpotent(3, 3), all(3, 3);
  oscillator << 0, 2, 0, -2, 0, 0.3, 0, 0, -1;
  unstable << -1, 0.5, 0, 0, 1, 0.2, 0, 0, -2;
  spiral << 0.5, 2, 0.1, -2, 0.5, 0, 0, 0, -3;
  nilpotent << 0, 1, 0, 0, 0, 0, 0, 0.2, -1;
  all << 1, 3, 0, -3, 1, 1, 0, 0, 2;
  for (const Subject& subject :
       {Subject{"oscillator", oscillator, 2}, Subject{"unstable", unstable, 1}, Subject{"spiral", spiral, 2},
        Subject{"nilpotent", nilpotent, 0}, Subject{"all", all, 3}}) {
    SCOPED_TRACE(subject.name);
    Problem problem = testing::FourVariableEasy();
    problem.A = subject.A;
    problem.M.MutableDense() += 4 * Matrix::Identity(4, 4);  // solvable for every state
    problem.horizon = 0.5;
    const Solution exact = SolveToEnd(problem, On(Method::kLaplaceIteration, 32));
    const Solution solution = SolveToEnd(problem, On(Method::kWuChenIteration, 32, 100));
    EXPECT_LT(MaxAbs(solution.x - exact.x), 1e-7 * MaxAbs(exact.x));
    ASSERT_TRUE(solution.contour.has_value());
    EXPECT_EQ(solution.contour->separated, subject.separated);
    const bool said = !solution.warnings.empty() && solution.warnings.back().find("Remark 2.1") != std::string::npos;
    EXPECT_EQ(said, subject.separated > 0);
    if (subject.separated == 3) {  // nothing is left for the contour, and nothing of its error
      EXPECT_LT(MaxAbs(solution.x - exact.x), 1e-11 * MaxAbs(exact.x));
    }
  }
}

TEST(WuChenIterationTest, ServesTheCasesWithSpectraOutsideTheSector) {
  for (const char* name : {"rlcd", "observer_lcs"}) {
    SCOPED_TRACE(name);
    Problem problem = testing::LoadCase(name).problem;
    problem.horizon = 0.2;
    Observer silent;
    const auto refused = Solve(problem, On(Method::kLaplaceIteration, 10), silent, {});
    ASSERT_TRUE(refused.ok());
    if (refused->termination == Termination::kUnsupported) continue;
    const Solution exact = SolveToEnd(problem, On(Method::kLaplaceIteration, 40));
    const Solution solution = SolveToEnd(problem, On(Method::kWuChenIteration, 40, 100));
    EXPECT_LT(MaxAbs(solution.x - exact.x), 1e-7 * MaxAbs(exact.x));
  }
}

// x' = -x + y + f with y = -(x + g) > 0 throughout: x' = -2x - g + f is as smooth as f and g are.
TEST(WuChenIterationTest, CubicSplinesAreOfFourthOrderOnSmoothData) {
  Problem problem = testing::Scalar(-1, 0, 0, 1.5);
  problem.g = TimeFunction::Formulas({"-3 - sin(3*t)"});
  const auto exact = [](double t) {
    return 1.5 + (2 * std::sin(3 * t) - 3 * std::cos(3 * t)) / 13 + (3.0 / 13 - 1.5) * std::exp(-2 * t);
  };
  const auto order = [&](Interpolation interpolation, double& fine) {
    const auto error = [&](Index steps) {
      Options options = On(Method::kWuChenIteration, steps, 150);
      options.interpolation = interpolation;
      const Solution solution = SolveToEnd(problem, options);
      double worst = 0;
      for (size_t k = 0; k < solution.times.size(); ++k) {
        EXPECT_GT(solution.y(0, k), 0.5);
        worst = NanMax(worst, std::abs(solution.x(0, k) - exact(solution.times[k])));
      }
      return worst;
    };
    const double coarse = error(24);
    fine = error(48);
    return std::log2(coarse / fine);
  };
  double linear = 0, cubic = 0;
  EXPECT_NEAR(order(Interpolation::kLinear, linear), 2, 0.2);
  EXPECT_GT(order(Interpolation::kCubicSpline, cubic), 3.7);  // 4 is reached from above
  EXPECT_LT(cubic, linear / 50);
}

// The same with y = max(0, -(x + g)), which leaves and meets zero between nodes: x'' is continuous, y' is not, and the
// spline gains nothing (Remark 2.5).
TEST(WuChenIterationTest, CubicSplinesAreOfSecondOrderAcrossKinks) {
  Problem problem = testing::Scalar(-1, 0, 0, 1.5);
  problem.g = TimeFunction::Formulas({"-1.2*sin(7*t)"});
  Options finest = On(Method::kLaplaceIteration, 12800, 49);
  finest.output_times_only = true;
  finest.output_times = {0.3, 0.6, 0.9, 1.2, 1.5};
  const Solution reference = SolveToEnd(problem, finest);
  EXPECT_GT(MaxAbs(reference.y), 0.1);
  // Kinks fall at other places of a step on every grid: the largest error of some grids is regular.
  const auto error = [&](Interpolation interpolation, Index steps) {
    double worst = 0;
    for (const Index more : {0, 5, 10, 15}) {
      Options options = finest;
      options.method = Method::kWuChenIteration;
      options.num_steps = steps + more;
      options.interpolation = interpolation;
      worst = NanMax(worst, MaxAbs(SolveToEnd(problem, options).x - reference.x));
    }
    return worst;
  };
  const double linear = error(Interpolation::kLinear, 30), cubic = error(Interpolation::kCubicSpline, 30);
  const double cubic_fine = error(Interpolation::kCubicSpline, 75);
  EXPECT_GT(cubic, linear / 4);
  EXPECT_LT(std::log(cubic / cubic_fine) / std::log(2.5), 3);  // 2 at second order, 4 at fourth
}

TEST(WuChenIterationTest, TakesTheContourThatIsAskedFor) {
  const Problem easy = testing::FourVariableEasy();
  const Solution exact = SolveToEnd(easy, On(Method::kLaplaceIteration, 32));
  for (const ContourChoice choice : {ContourChoice::kAuto, ContourChoice::kTheorem22, ContourChoice::kRemark24}) {
    Options options = On(Method::kWuChenIteration, 32, 64);
    options.contour = choice;
    const Solution solution = SolveToEnd(easy, options);
    EXPECT_EQ(solution.contour->choice, choice == ContourChoice::kRemark24 ? "Remark 2.4" : "Theorem 2.2");
    EXPECT_LT(MaxAbs(solution.x - exact.x), 1e-5 * MaxAbs(exact.x));
    // Γ of Theorem 2.2 has γ = 0.794; Remark 2.4 leaves γ to the sector.
    EXPECT_EQ(solution.contour->gamma == 0.794, choice != ContourChoice::kRemark24);
  }
  // A sector that is too wide for Theorem 2.2: asked for, its eigenvalues are split off.
  Problem wide = easy;
  wide.A.MutableDense() << -1, 2.5, 0, -2.5, -1, 0, 0, 0, -1;
  wide.horizon = 0.5;
  Options options = On(Method::kWuChenIteration, 32, 64);
  options.contour = ContourChoice::kTheorem22;
  const Solution split = SolveToEnd(wide, options);
  EXPECT_EQ(split.contour->separated, 2);
  EXPECT_EQ(split.contour->choice, "Theorem 2.2");
  EXPECT_LT(MaxAbs(split.x - SolveToEnd(wide, On(Method::kLaplaceIteration, 32)).x), 1e-5);
}

// Eigenvalues -1 ± 2.5i, α = 1.19: Theorem 2.2's contour leaves them out, Remark 2.4's does not.
TEST(WuChenIterationTest, TakesAnotherContourForAWideSector) {
  Problem problem = testing::FourVariableEasy();
  problem.A.MutableDense() << -1, 2.5, 0, -2.5, -1, 0, 0, 0, -1;
  problem.horizon = 0.5;
  Options options = On(Method::kWuChenIteration, 32, 100);
  options.contour_for_initial_state = true;
  const Solution exact = SolveToEnd(problem, On(Method::kLaplaceIteration, 32));
  const Solution solution = SolveToEnd(problem, options);
  EXPECT_LT(MaxAbs(solution.x - exact.x), 1e-4 * MaxAbs(exact.x));
  EXPECT_GT(MaxAbs(solution.x - exact.x), 0);
  ASSERT_EQ(solution.warnings.size(), 2u);
  EXPECT_NE(solution.warnings[0].find("Remark 2.4"), std::string::npos) << solution.warnings[0];
  EXPECT_NE(solution.warnings[1].find("Remark 2.3"), std::string::npos) << solution.warnings[1];
}

TEST(WuChenIterationTest, HasTheSameBitsForAnyNumberOfThreads) {
  Options options = On(Method::kWuChenIteration, 60, 16);
  options.num_threads = 1;
  const Solution one = SolveToEnd(testing::FourVariableEasy(), options);
  options.num_threads = 3;
  const Solution many = SolveToEnd(testing::FourVariableEasy(), options);
  EXPECT_TRUE((one.x.array() == many.x.array()).all());
}

TEST(WuChenIterationTest, StaysBelowTheBoundOfTheoremTwoTwo) {
  class Check : public Observer {
   public:
    void OnIterate(const IterateReport& iterate, const IterateValues& values) override {
      EXPECT_EQ(values.y.cols(), static_cast<Index>(values.times.size()));
      times.assign(values.times.begin(), values.times.end());
      y = values.y;
      ASSERT_TRUE(iterate.log10_bound.has_value());
      if (iterate.change > 1e-13) {
        EXPECT_LE(std::log10(iterate.change), *iterate.log10_bound + 1e-9);
      }
      ++count;
    }
    int count = 0;
    std::vector<double> times;  // of the last iterate
    Matrix y;
  } check;
  const auto solution = Solve(testing::FourVariableEasy(), On(Method::kWuChenIteration, 32), check, {});
  ASSERT_TRUE(solution.ok());
  EXPECT_EQ(check.times, solution->times);
  EXPECT_TRUE((check.y.array() == solution->y.array()).all());
  EXPECT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
  EXPECT_GT(check.count, 10);
}

// y^{k+1} solves the LCPs of x^k.
TEST(WuChenIterationTest, KeepsTheLastIterateWhereIterationsRunOut) {
  const Problem problem = testing::FourVariableEasy();
  for (const Method method : {Method::kWuChenIteration, Method::kLaplaceIteration}) {
    Options options = On(method, 32);
    options.window_steps = Options::kWholeHorizon;
    options.max_iterations = 3;
    const Solution third = testing::SolveWith(problem, options);
    options.max_iterations = 4;
    const Solution fourth = testing::SolveWith(problem, options);
    ASSERT_EQ(third.termination, Termination::kIterationLimit) << third.message;
    ASSERT_EQ(third.times.size(), 33u);
    ASSERT_EQ(fourth.times.size(), 33u);
    EXPECT_GT(MaxAbs(third.x - fourth.x), 1e-6);
    TimeFunctionEvaluator g = TimeFunctionEvaluator::Create(problem.g, problem.num_constraints()).value();
    Vector q(problem.num_constraints());
    for (Index j = 1; j <= 32; ++j) {
      g.Evaluate(third.times[j], Side::kRight, q);
      q += problem.N * third.x.col(j);
      const LcpResult lcp = SolveLcp(problem.M, q, SolutionRule::kLeastElement).value();
      EXPECT_LT(MaxAbs(lcp.y - fourth.y.col(j)), 1e-10) << MethodName(method) << ", node " << j;
    }
  }
}

// x' = x - 28 (y1 - y2) with y1 - y2 = max(0, x) - max(0, -x) = x: changes grow like 28^k/k! and then fall.
TEST(WuChenIterationTest, ConvergesAfterChangesHaveGrownByNineDigits) {
  Problem problem;
  problem.A = Matrix{{1}};
  problem.B = Matrix{{-28, 28}};
  problem.M = Matrix{{1, 0}, {0, 1}};
  problem.N = Matrix{{-1}, {1}};
  problem.f = TimeFunction::Formulas({"0"});
  problem.g = TimeFunction::Formulas({"0", "0"});
  problem.x0 = Vector{{1}};
  problem.horizon = 1;
  Options options = On(Method::kWuChenIteration, 64);
  options.iteration_tolerance = 1e-4;
  const Solution solution = testing::SolveWith(problem, options);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_LT(MaxAbs(solution.x - SolveToEnd(problem, On(Method::kLaplaceIteration, 64)).x), 1e-4);
}

// Feedback of gain 4 on [0, 40]: the iteration over the whole of it diverges, whatever the steps.
TEST(WuChenIterationTest, EndsAtTheFirstTrialThatDiverges) {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{4}};
  problem.M = Matrix{{1}};
  problem.N = Matrix{{-1}};
  problem.f = problem.g = TimeFunction::Formulas({"sin(t)"});
  problem.x0 = Vector{{-1}};
  problem.horizon = 40;
  Options options;
  options.method = Method::kWuChenIteration;
  struct : Observer {
    void OnWindowStarted(const WindowReport&) override { ++windows; }
    int windows = 0;
  } observer;
  const Solution solution = Solve(problem, options, observer, {}).value();
  EXPECT_EQ(solution.termination, Termination::kDiverged) << solution.message;
  EXPECT_EQ(observer.windows, 1);
}

}  // namespace
}  // namespace dlcs
