// SPDX-License-Identifier: Apache-2.0
// Components that are exactly zero beside a guard that decays to zero or touches it. The polynomials of the guard dip
// below zero there by what they miss, and their own size allows these components nothing.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

// x' = -x + y + f, 0 <= y ⟂ N x + g + M y >= 0 on [0, T].
struct ZeroPair {
  std::string name;
  double N, M;
  std::string f, g;
  double x0, T;
  std::function<double(double)> x;
};

double Decay(double t) { return std::exp(-t); }
double Zero(double) { return 0; }

ZeroPair PairBesideGuard(const std::string& name, const std::string& g, double T) {
  return {name, 0, 1, "0", g, 1, T, Decay};
}
// y holds x at zero.
ZeroPair StateBesideGuard(const std::string& name, const std::string& f, double T) {
  return {name, 1, 0, f, "0", 0, T, Zero};
}

class ZeroPairs : public ::testing::TestWithParam<ZeroPair> {};

TEST_P(ZeroPairs, AreSolved) {
  const ZeroPair& pair = GetParam();
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{1}};
  problem.N = Matrix{{pair.N}};
  problem.M = Matrix{{pair.M}};
  problem.x0 = Vector{{pair.x0}};
  problem.horizon = pair.T;
  problem.f = TimeFunction::Formulas({pair.f});
  problem.g = TimeFunction::Formulas({pair.g});
  for (const double tolerance : {1e-2, 1e-4, 1e-7, 1e-10}) {
    Options options;
    options.error_tolerance = tolerance;
    options.method = Method::kEventDriven;
    const Solution solution = testing::SolveWith(problem, options);
    const Verdict verdict = JudgeSolution(solution);
    EXPECT_EQ(verdict.kind, VerdictKind::kSolved) << tolerance << ": " << verdict.text;
    for (Index k = 0; k < solution.x.cols(); ++k) {
      const double t = solution.times[static_cast<std::size_t>(k)];
      EXPECT_NEAR(solution.x(0, k), pair.x(t), tolerance * std::abs(pair.x0)) << tolerance << " at " << t;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Guards, ZeroPairs,
                         ::testing::Values(PairBesideGuard("APairAndADecay", "exp(-3*t)", 10),
                                           PairBesideGuard("AFastOne", "exp(-100*t)", 10),
                                           PairBesideGuard("ADecayingWave", "exp(-20*t)*(1.5+cos(9*t))", 3),
                                           PairBesideGuard("AGuardThatTouchesZero", "1+sin(pi*t)", 10),
                                           PairBesideGuard("AFourthPower", "(t-0.7)**4", 3),
                                           PairBesideGuard("AGuardThatStaysAtZero", "max(0,1-t)", 2),
                                           ZeroPair{"OtherUnits", 0, 1e9, "0", "1e9*exp(-5*t)", 1, 9, Decay},
                                           PairBesideGuard("SmallUnits", "1e-9*exp(-5*t)", 9),
                                           ZeroPair{"WithFeedback", 1, 1, "0", "exp(-3*t)", 0, 10, Zero},
                                           StateBesideGuard("AStateHeldByADecay", "-exp(-300*t)", 2),
                                           StateBesideGuard("ASlowOne", "-exp(-2*t)", 20),
                                           StateBesideGuard("AForceThatTouchesZero", "-1-cos(3*t)", 10)),
                         [](const ::testing::TestParamInfo<ZeroPair>& pair) { return pair.param.name; });

// w = max(0, 1 - t) is a difference of x and g, and stays at zero with the errors of x.
TEST(ZeroPairsTest, AGuardIsZeroBesideY) {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{-1}};
  problem.N = Matrix{{1}};
  problem.M = Matrix{{1}};
  problem.f = TimeFunction::Formulas({"cos(2.44*t) - 2.44*sin(2.44*t)"});
  problem.g = TimeFunction::Formulas({"max(0, 1-t) - cos(2.44*t)"});
  problem.x0 = Vector{{1}};
  problem.horizon = 2;
  for (const double tolerance : {1e-4, 1e-6, 1e-7, 1e-9}) {
    Options options;
    options.error_tolerance = tolerance;
    const Solution solution = testing::SolveWith(problem, options);
    const Verdict verdict = JudgeSolution(solution);
    EXPECT_EQ(verdict.kind, VerdictKind::kSolved) << tolerance << ": " << verdict.text;
    EXPECT_LE(MaxAbs(solution.y), 1e-14);
  }
}

// N x0 + g is an ulp of its terms above or below zero, which a solve may take for zero: w or y is that ulp.
TEST(ZeroPairsTest, NamesTheSideOfAPairThatRoundingDecides) {
  for (const double scale : {1.0, 1e-6, 1e6}) {
    for (const double side : {-1.0, 1.0}) {
      Problem problem;
      problem.A = Matrix{{0}};
      problem.B = Matrix{{0}};
      problem.N = Matrix{{scale}};
      problem.M = Matrix{{scale / 4}};
      const double g = std::nextafter(-0.3, side) * scale;
      problem.g = TimeFunction::Constant(Vector{{g}});
      problem.f = TimeFunction::Zero(1);
      problem.x0 = Vector{{0.3}};
      problem.horizon = 1;
      const double w = scale * 0.3 + g;
      const Solution solution = testing::SolveWith(problem, {});
      EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved) << scale;
      const double exact_w = std::max(w, 0.0), exact_y = std::max(-w, 0.0) / (scale / 4);
      double allowed_y = 1e-6 * exact_y, allowed_w = 1e-6 * exact_w;
      for (const NamedComponent& named : solution.accuracy.named) {
        (named.component.kind == ComponentKind::kPair ? allowed_y : allowed_w) = 2 * named.rounding;
      }
      EXPECT_LE(std::abs(solution.y(0, 0) - exact_y), allowed_y) << scale << ", " << side;
      EXPECT_LE(std::abs(solution.w(0, 0) - exact_w), allowed_w) << scale << ", " << side;
    }
  }
}

// Two pairs hold x at (0, sin 6t): x1 is a difference of their rows, and the errors of the rows cancel in it as their
// terms do.
TEST(ZeroPairsTest, AStateIsHeldAtZeroByTwoPairs) {
  for (const double angle : {0.3, 0.7, 1.2}) {
    const double c = std::cos(angle), s = std::sin(angle);
    Problem problem;
    problem.A = Matrix::Zero(2, 2);
    problem.M = Matrix::Zero(2, 2);
    const auto number = [](double value) { return std::to_string(value); };
    problem.B = Matrix{{std::stod(number(c)), std::stod(number(s))}, {-std::stod(number(s)), std::stod(number(c))}};
    problem.N = problem.B.Dense().transpose();
    problem.f = TimeFunction::Formulas(
        {"-(" + number(c) + ") - (" + number(s) + ")", "6*cos(6*t) + (" + number(s) + ") - (" + number(c) + ")"});
    problem.g = TimeFunction::Formulas({"(" + number(s) + ")*sin(6*t)", "-(" + number(c) + ")*sin(6*t)"});
    problem.x0 = Vector{{0, 0}};
    problem.horizon = 2;
    for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
      Options options;
      options.error_tolerance = tolerance;
      const Solution solution = testing::SolveWith(problem, options);
      const Verdict verdict = JudgeSolution(solution);
      EXPECT_EQ(verdict.kind, VerdictKind::kSolved) << angle << " " << tolerance << ": " << verdict.text;
      EXPECT_EQ(solution.method, Method::kEventDriven);
      EXPECT_LE(MaxAbs(solution.y.array() - 1), tolerance);
    }
  }
}

}  // namespace
}  // namespace dlcs
