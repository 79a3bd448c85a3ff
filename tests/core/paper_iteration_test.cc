// SPDX-License-Identifier: Apache-2.0

#include "core/methods/paper_iteration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

Solution SolveWith(const Problem& problem, Options options) {
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  if (!solution.ok()) return {};
  EXPECT_EQ(solution->termination, Termination::kConverged) << solution->message;
  return *std::move(solution);
}

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

class PaperIterationTest : public ::testing::TestWithParam<SectorialCase> {};

TEST_P(PaperIterationTest, AgreesWithLaplaceIterationToTheAccuracyOfItsContour) {
  Problem problem = testing::LoadCase(GetParam().name).problem;
  problem.horizon = GetParam().horizon;
  const Index steps = 50;
  const Solution reference = SolveWith(problem, On(Method::kLaplaceIteration, steps));
  const double scale = MaxAbs(reference.x);
  const auto error = [&](Index nodes) {
    const Solution solution = SolveWith(problem, On(Method::kPaperIteration, steps, nodes));
    if (solution.termination != Termination::kConverged) return std::nan("");
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

INSTANTIATE_TEST_SUITE_P(Sectorial, PaperIterationTest,
                         ::testing::Values(SectorialCase{"z_least", 2}, SectorialCase{"formula_zoo", 2},
                                           SectorialCase{"wall_permeable", 0.1}));

TEST(PaperIterationTest, TakesTheContourOfRemark23ForTheInitialState) {
  Options options = On(Method::kPaperIteration, 40, 25);
  const Solution exact = SolveWith(testing::FourVariableEasy(), options);
  options.contour_for_initial_state = true;
  const Solution contour = SolveWith(testing::FourVariableEasy(), options);
  EXPECT_LT(MaxAbs(exact.x - contour.x), 1e-10);
  EXPECT_GT(MaxAbs(exact.x - contour.x), 0);
}

TEST(PaperIterationTest, RefusesASpectrumOutsideTheSector) {
  Observer silent;
  for (const char* name : {"rlcd", "observer_lcs"}) {
    const auto solution = Solve(testing::LoadCase(name).problem, On(Method::kPaperIteration, 10), silent, {});
    ASSERT_TRUE(solution.ok());
    EXPECT_EQ(solution->termination, Termination::kUnsupported) << name;
    EXPECT_NE(solution->message.find("sector"), std::string::npos) << solution->message;
  }
}

// Eigenvalues -1 ± 2.5i, α = 1.19: Theorem 2.2's contour leaves them out, Remark 2.4's does not.
TEST(PaperIterationTest, TakesAnotherContourForAWideSector) {
  Problem problem = testing::FourVariableEasy();
  problem.A << -1, 2.5, 0, -2.5, -1, 0, 0, 0, -1;
  problem.horizon = 0.5;
  Options options = On(Method::kPaperIteration, 32, 100);
  options.contour_for_initial_state = true;
  const Solution exact = SolveWith(problem, On(Method::kLaplaceIteration, 32));
  const Solution solution = SolveWith(problem, options);
  EXPECT_LT(MaxAbs(solution.x - exact.x), 1e-4 * MaxAbs(exact.x));
  EXPECT_GT(MaxAbs(solution.x - exact.x), 0);
  ASSERT_EQ(solution.warnings.size(), 2u);
  EXPECT_NE(solution.warnings[0].find("Remark 2.4"), std::string::npos) << solution.warnings[0];
  EXPECT_NE(solution.warnings[1].find("Remark 2.3"), std::string::npos) << solution.warnings[1];
}

TEST(PaperIterationTest, HasTheSameBitsForAnyNumberOfThreads) {
  Options options = On(Method::kPaperIteration, 60, 16);
  options.num_threads = 1;
  const Solution one = SolveWith(testing::FourVariableEasy(), options);
  options.num_threads = 3;
  const Solution many = SolveWith(testing::FourVariableEasy(), options);
  EXPECT_TRUE((one.x.array() == many.x.array()).all());
}

TEST(PaperIterationTest, StaysBelowTheBoundOfTheoremTwoTwo) {
  class Check : public Observer {
   public:
    void OnIterate(const IterateReport& iterate) override {
      ASSERT_TRUE(iterate.log10_bound.has_value());
      if (iterate.change > 1e-13) {
        EXPECT_LE(std::log10(iterate.change), *iterate.log10_bound + 1e-9);
      }
      ++count;
    }
    int count = 0;
  } check;
  const auto solution = Solve(testing::FourVariableEasy(), On(Method::kPaperIteration, 32), check, {});
  ASSERT_TRUE(solution.ok());
  EXPECT_EQ(solution->termination, Termination::kConverged) << solution->message;
  EXPECT_GT(check.count, 10);
}

}  // namespace
}  // namespace dlcs
