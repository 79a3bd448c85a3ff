// SPDX-License-Identifier: Apache-2.0
// What the error figure says, against closed forms and against solves with rounded data.

#include "core/event_driven/error_growth.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/event_driven/rounded_data.h"
#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::ExampleFourOne;
using testing::ExampleFourOneExact;
using testing::kNoTolerance;
using testing::LastState;
using testing::Scalar;
using testing::SolveAt;

TEST(ErrorGrowthTest, EstimatesItsError) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = 1e-6;
  Observer silent;
  const auto solution = Solve(ExampleFourOne(), options, silent, {});
  ASSERT_TRUE(solution.ok());
  const Vector x = ExampleFourOneExact(1);
  const double at_end = MaxAbs(solution->x.rightCols(1) - x) / MaxAbs(solution->x);
  EXPECT_GE(3 * solution->accuracy.error, at_end);
  EXPECT_LT(solution->accuracy.error, 1e-6);
}

TEST(ErrorGrowthTest, MeasuresErrorsAgainstTheStartToo) {
  const Solution solution = SolveAt(Scalar(-1, 0, 5, 2), 1e-9);  // x = 5 e^{-t}
  EXPECT_DOUBLE_EQ(solution.certificate.x_scale, 5);
}

// x' = x. On a long step the polynomial of the step misses its start by little against its end, and the growth of the
// whole step is wrong by as much against its start.
TEST(ErrorGrowthTest, FiguresHoldWhereModesGrow) {
  Problem problem;
  problem.A = Matrix{{1}};
  problem.B = problem.N = Matrix{{0}};
  problem.M = Matrix{{1}};
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{1}});
  problem.x0 = Vector{{1}};
  for (const double horizon : {12.0, 20.0, 30.0, 40.0, 100.0}) {
    problem.horizon = horizon;
    for (const double tolerance : {0.1, 1e-2, 1e-3, 1e-6}) {
      const Solution solution = SolveAt(problem, tolerance, {horizon});
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      const double error = std::abs(solution.x(0, solution.x.cols() - 1) / std::exp(horizon) - 1);
      EXPECT_LE(error, 3 * solution.accuracy.error) << "T = " << horizon << ", tolerance " << tolerance;
    }
  }
}

// x2 follows x1 at the rate r, and from the event at te on y keeps x1 + x2/2 at 3/4: y is 1.49 exp(-1.5 r (t - te)), so
// that an error of te is one of y, 1.5 r times as large. te in 40 digits, as the root of x1 + x2/2 - 3/4 with
// x1 = -0.05 sin 3t + 0.15 cos 3t + 0.85 exp(-t) and what x2 makes of it.
TEST(ErrorGrowthTest, AnEventIsAsLateAsYOfFastStatesShows) {
  struct Case {
    double rate, event;
  };
  for (const auto& [rate, event] : {Case{1e9, 0.475929231162725009}, Case{1e10, 0.475929230862725009}}) {
    Problem problem;
    problem.A = Matrix{{-1, 0}, {rate, -rate}};
    problem.B = Matrix{{1}, {0}};
    problem.N = Matrix{{1, 0.5}};
    problem.M = Matrix{{0}};
    problem.f = TimeFunction::Formulas({"-0.5*sin(3*t)", "0"});
    problem.g = TimeFunction::Constant(Vector{{-0.75}});
    problem.x0 = Vector{{1, 1}};
    problem.horizon = 1;
    const double late = event + 0.05 / (1.5 * rate);
    // x2 lags behind x1 by x1'/r, so at the event it is above 1/2 by two thirds of that.
    const double slope = -0.15 * std::cos(3 * event) - 0.45 * std::sin(3 * event) - 0.85 * std::exp(-event);
    const auto y = [rate, event, above = -slope / (1.5 * rate)](double t) {
      return 0.75 * rate * above * std::exp(-1.5 * rate * (t - event)) + 0.5 + 0.5 * std::sin(3 * t);
    };
    for (const double tolerance : {1e-4, 1e-5}) {
      const Solution solution = SolveAt(problem, tolerance, {0, late, 1});
      EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved) << rate << ", " << tolerance;
      const double of_time = 1.5 * rate * 16 * std::numeric_limits<double>::epsilon() * event;
      EXPECT_LE(std::abs(solution.y(0, 1) - y(solution.times[1])), (tolerance + of_time) * y(event))
          << rate << ", " << tolerance;
    }
  }
}

// x1 = x3 keep x2 at zero, to the bit; any error of x2 grows by e^1000 in a unit of time.
TEST(ErrorGrowthTest, AnErrorBeyondTheRangeOfNumbersIsInfinite) {
  Problem problem;
  problem.A = Matrix{{-1, 0, 0, 0}, {1, 1000, -1, 0}, {0, 0, -1, 0}, {0, 1, 0, -1}};
  problem.B = Matrix::Zero(4, 1);
  problem.N = Matrix::Zero(1, 4);
  problem.M = Matrix{{1}};
  problem.f = TimeFunction::Zero(4);
  problem.g = TimeFunction::Constant(Vector{{1}});
  problem.x0 = Vector{{1, 0, 1, 1}};
  problem.horizon = 2;
  const Solution solution = SolveAt(problem, 1e-6, {problem.horizon});
  EXPECT_EQ(solution.termination, Termination::kReachedEnd);
  EXPECT_EQ(solution.accuracy.error, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(JudgeSolution(solution).success);
}

// What rounding of w may hide is no solution: w = x1 + g + y with terms of 2^43 is sin t + y, so that x2' = y makes
// x2(2π) = 2, and w of a small difference of states 1e12 times as large.
TEST(ErrorGrowthTest, CountsAsAnErrorWhatRoundingMayHide) {
  Problem large;
  large.A = Matrix{{0.0, 0.0}, {0.0, 0.0}};
  large.B = Matrix{{0.0}, {1.0}};
  large.N = Matrix{{1.0, 0.0}};
  large.M = Matrix{{1.0}};
  large.f = TimeFunction::Constant(Vector::Zero(2));
  large.g = TimeFunction::Formulas({"sin(t)-8796093022208"});
  large.x0 = Vector{{8796093022208, 0.0}};
  large.horizon = 8;
  EXPECT_GT(SolveAt(large, 1e-6).accuracy.error, 0.3);

  Problem difference;
  difference.A = Matrix{{-1.0, 0.0, 0.0}, {0.0, -1.000000000001, 0.0}, {0.0, 0.0, -1.0}};
  difference.B = Matrix{{0.0}, {0.0}, {1.0}};
  difference.N = Matrix{{-1e12, 1e12, 0.0}};
  difference.M = Matrix{{1.0}};
  difference.f = TimeFunction::Formulas({"sin(5*t)", "sin(5*t)", "0"});
  difference.g = TimeFunction::Constant(Vector::Zero(1));
  difference.x0 = Vector{{0.0, 0.0, 0.0}};
  difference.horizon = 5;
  EXPECT_GT(SolveAt(difference, 1e-6).accuracy.error, 0.3);
}

// x1 = 1e6 cos 10t drives x2 = small sin 5t, whose terms of 5e7 cancel but for rounding: the figure counts what that is
// of x2, also where x2 is no larger than the bound of its rounding.
TEST(ErrorGrowthTest, CountsRoundingInWhatIsLeftOfLargeTerms) {
  Problem problem;
  problem.A = Matrix{{-100, 0}, {-50, -0.01}};
  problem.B = Matrix::Zero(2, 1);
  problem.N = Matrix::Zero(1, 2);
  problem.M = Matrix{{1}};
  problem.g = TimeFunction::Constant(Vector{{1}});
  problem.x0 = Vector{{1e6, 0}};
  problem.horizon = 3;
  for (const double small : {1e-2, 1e-4, 1e-5, 2e-6, 1e-6}) {
    const std::string size = FormatNumber(small);
    problem.f = TimeFunction::Formulas(
        {"-1e7*sin(10*t)+100.0*1e6*cos(10*t)", "5e7*cos(10*t)+" + size + "*(5*cos(5*t)+0.01*sin(5*t))"});
    const Solution solution = SolveAt(problem, kNoTolerance);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    double error = 0;
    for (Index k = 0; k < solution.x.cols(); ++k) {
      error = std::max(error, std::abs(solution.x(1, k) / small - std::sin(5 * solution.times[k])));
    }
    EXPECT_GT(error, 1e-8) << size;  // it is rounding
    const ErrorsByCause& figure = solution.accuracy.errors.x;
    EXPECT_GE((figure.truncation[1] + figure.rounding[1]) / figure.own[1], error) << size;
  }
}

// x' = A x, whose modes are fast, growing and slow. An ulp of A moves the part that grows by some 1e7 ulps in a unit of
// time. The rounding errors of the rows have the ratios of the fast mode. Two rows alone reach the part that grows: for
// one of both choices of their signs the errors cancel.
TEST(ErrorGrowthTest, CountsUlpsOfTheDataWhateverTheirSigns) {
  const Vector rates{{-1e7, 40, -3}};
  constexpr double kMoreThanTheDataAllow = 1e-11;
  constexpr unsigned kRoundings = 8;
  for (int signs = 0; signs < 16; ++signs) {
    const auto sign = [signs](int bit) { return (signs >> bit) % 2 == 0 ? 1.0 : -1.0; };
    for (Index unreached = 0; unreached < 3; ++unreached) {
      const Vector fast{{0.9, 0.7 * sign(0), 0.6 * sign(1)}}, growing{{1, 0.5 * sign(2), 0.35 * sign(3)}};
      Matrix modes(3, 3);
      modes << fast, growing, fast + Vector::Unit(3, unreached);
      Problem problem;
      problem.A = Matrix(modes * rates.asDiagonal() * modes.inverse());
      problem.B = Matrix::Zero(3, 1);
      problem.N = Matrix::Zero(1, 3);
      problem.M = Matrix{{1.0}};
      problem.f = TimeFunction::Zero(3);
      problem.g = TimeFunction::Constant(Vector{{1.0}});
      problem.x0 = modes * Vector{{0, 1, 0.1}};
      problem.horizon = 0.7;
      const Solution solution = SolveAt(problem, kMoreThanTheDataAllow, {problem.horizon});
      const Vector x = LastState(solution);
      double moved = 0;
      for (unsigned seed = 1; seed <= kRoundings; ++seed) {
        const Problem rounded = WithRoundedData(problem, 1, false, seed);
        const Vector change = LastState(SolveAt(rounded, kMoreThanTheDataAllow, {problem.horizon})) - x;
        moved = std::max(moved, MaxAbs(change.cwiseQuotient(x)));
      }
      EXPECT_GT(moved, 1e-10);
      EXPECT_LE(moved, 3 * solution.accuracy.error) << "signs " << signs << ", unreached " << unreached;
    }
  }
}

}  // namespace
}  // namespace dlcs
