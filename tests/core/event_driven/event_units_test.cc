// SPDX-License-Identifier: Apache-2.0
// Event location in units of any size, beside fast modes, and what it says of its own error.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

Solution SolveInUnitsAt(const Problem& problem, double tolerance, const std::vector<double>& times) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = tolerance;
  options.output_times = times;
  options.output_times_only = true;
  return testing::SolveWith(problem, options);
}

std::vector<double> Times(double horizon, int count) {
  std::vector<double> times;
  for (int k = 1; k <= count; ++k) times.push_back(horizon * k / count);
  return times;
}

// The largest error of a component relative to its size, as the certificate has it.
double RelativeError(const Matrix& x, const Matrix& exact) {
  const Vector error = RowMaxAbs(x - exact), size = RowMaxAbs(exact);
  double largest = 0;
  for (Index i = 0; i < error.size(); ++i) largest = NanMax(largest, error[i] == 0 ? 0 : error[i] / size[i]);
  return largest;
}

struct RandomSystem {
  Problem problem;
  std::vector<std::string> f, g;
};

// M positive definite, not symmetric; sources that oscillate, so that modes change.
RandomSystem MakeRandom(unsigned seed, Index m, Index n) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto gaussian = [&](Index rows, Index cols) {
    return Matrix::NullaryExpr(rows, cols, [&] { return normal(random); });
  };
  RandomSystem system;
  Problem& problem = system.problem;
  problem.A = gaussian(m, m) - Matrix::Identity(m, m);
  problem.B = gaussian(m, n);
  problem.N = gaussian(n, m);
  const Matrix root = gaussian(n, n), skew = gaussian(n, n);
  problem.M = root * root.transpose() + skew - skew.transpose() + 0.2 * Matrix::Identity(n, n);
  problem.x0 = gaussian(m, 1).col(0);
  problem.horizon = 4;
  const auto wave = [&] {
    return NumberText(normal(random)) + "+" + NumberText(2 * normal(random)) + "*sin(" +
           NumberText(1 + std::abs(normal(random))) + "*t+" + NumberText(normal(random)) + ")";
  };
  for (Index i = 0; i < m; ++i) system.f.push_back(wave());
  for (Index i = 0; i < n; ++i) system.g.push_back(wave());
  problem.f = TimeFunction::Formulas(system.f);
  problem.g = TimeFunction::Formulas(system.g);
  return system;
}

// The same system with x = states · x', y = pairs · y', w = w' / pairs.
Problem InUnits(const RandomSystem& system, const Vector& states, const Vector& pairs) {
  Problem problem = system.problem;
  const Vector over_states = states.cwiseInverse();
  problem.A = Matrix(over_states.asDiagonal() * problem.A.Dense() * states.asDiagonal());
  problem.B = Matrix(over_states.asDiagonal() * problem.B.Dense() * pairs.asDiagonal());
  problem.N = Matrix(pairs.asDiagonal() * problem.N.Dense() * states.asDiagonal());
  problem.M = Matrix(pairs.asDiagonal() * problem.M.Dense() * pairs.asDiagonal());
  problem.x0 = over_states.cwiseProduct(problem.x0);
  std::vector<std::string> f = system.f, g = system.g;
  for (std::size_t i = 0; i < f.size(); ++i) f[i] = "(" + f[i] + ")*" + NumberText(over_states[static_cast<Index>(i)]);
  for (std::size_t i = 0; i < g.size(); ++i) g[i] = "(" + g[i] + ")*" + NumberText(pairs[static_cast<Index>(i)]);
  problem.f = TimeFunction::Formulas(f);
  problem.g = TimeFunction::Formulas(g);
  return problem;
}

TEST(EventUnitsTest, PowersOfTwoChangeNothing) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const RandomSystem system = MakeRandom(seed, 3, 4);
    const std::vector<double> times = Times(4, 16);
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> power(-30, 30);
    const auto units = [&](Index size) {
      return Vector::NullaryExpr(size, [&] { return std::exp2(power(random)); }).eval();
    };
    const Vector states = units(3), pairs = units(4);
    for (const double tolerance : {1e-4, 1e-9}) {
      const Solution even = SolveInUnitsAt(system.problem, tolerance, times);
      const Solution scaled = SolveInUnitsAt(InUnits(system, states, pairs), tolerance, times);
      ASSERT_EQ(even.termination, scaled.termination) << seed << ": " << scaled.message;
      EXPECT_EQ(even.cost.steps, scaled.cost.steps) << seed;
      EXPECT_LT(RelativeError(states.asDiagonal() * scaled.x, even.x), 1e-13) << seed;
      EXPECT_LT(RelativeError(pairs.asDiagonal() * scaled.y, even.y), 1e-12) << seed;
    }
  }
}

TEST(EventUnitsTest, OtherUnitsKeepTheTolerance) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const RandomSystem system = MakeRandom(seed, 4, 3);
    const std::vector<double> times = Times(4, 16);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> power(-8, 8);
    const auto units = [&](Index size) {
      return Vector::NullaryExpr(size, [&] { return std::pow(10, power(random)); }).eval();
    };
    const Vector states = units(4), pairs = units(3);
    const Solution exact = SolveInUnitsAt(system.problem, 1e-12, times);
    const Problem problem = InUnits(system, states, pairs);
    for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
      const Solution scaled = SolveInUnitsAt(problem, tolerance, times);
      ASSERT_EQ(scaled.termination, Termination::kReachedEnd) << seed << ": " << scaled.message;
      EXPECT_LT(RelativeError(states.asDiagonal() * scaled.x, exact.x), tolerance) << seed;
    }
  }
}

TEST(EventUnitsTest, StretchedTimeChangesNothing) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const RandomSystem system = MakeRandom(seed, 3, 3);
    const Solution even = SolveInUnitsAt(system.problem, 1e-8, Times(4, 16));
    for (const int power : {-40, 40}) {
      const double stretch = std::exp2(power);
      Problem problem = system.problem;
      problem.A = Matrix(problem.A.Dense() / stretch);
      problem.B = Matrix(problem.B.Dense() / stretch);
      problem.horizon *= stretch;
      const auto stretched = [&](std::string formula, double factor) {
        const std::size_t t = formula.find("*t+");
        formula.replace(t, 3, "*(t*" + NumberText(1 / stretch) + ")+");
        return "(" + formula + ")*" + NumberText(factor);
      };
      std::vector<std::string> f, g;
      for (const std::string& formula : system.f) f.push_back(stretched(formula, 1 / stretch));
      for (const std::string& formula : system.g) g.push_back(stretched(formula, 1));
      problem.f = TimeFunction::Formulas(f);
      problem.g = TimeFunction::Formulas(g);
      const Solution slow = SolveInUnitsAt(problem, 1e-8, Times(4 * stretch, 16));
      ASSERT_EQ(slow.termination, even.termination) << slow.message;
      EXPECT_LT(RelativeError(slow.x, even.x), 1e-13) << seed;
    }
  }
}

// x_i' = -λ_i x_i + b_i y + f_i, y = 50 - n x > 0: with weak feedback, n x = 0 but for x_1, a triangular system with a
// closed form.
TEST(EventUnitsTest, SlowModesKeepTheirDigitsBesideFastOnes) {
  for (const double fast : {1e6, 1e9, 1e14}) {
    const double slow = 1e-3, horizon = 50;
    Problem problem;
    problem.A = Matrix{{-fast, 0}, {0, -slow}};
    problem.B = Matrix{{1}, {0.5}};
    problem.N = Matrix{{0.25, 0}};
    problem.M = Matrix::Ones(1, 1);
    problem.f = TimeFunction::Zero(2);
    problem.g = TimeFunction::Constant(Vector::Constant(1, -50));
    problem.x0 = Vector{{0.5, 1}};
    problem.horizon = horizon;
    // x_1 → 50/(λ + 1/4) within a moment; x_2' = -λ_2 x_2 + (50 - x_1/4)/2.
    const double rate = fast + 0.25, settled = 50 / rate;
    const auto exact = [&](double t) {
      const double drive = (50 - settled / 4) / 2;
      const double transient = -(0.5 - settled) / 8 * (std::exp(-slow * t) - std::exp(-rate * t)) / (rate - slow);
      return std::exp(-slow * t) - drive / slow * std::expm1(-slow * t) + transient;
    };
    const std::vector<double> times = Times(horizon, 5);
    for (const double tolerance : {1e-4, 1e-8, 1e-10}) {
      const Solution solution = SolveInUnitsAt(problem, tolerance, times);
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      for (std::size_t k = 0; k < times.size(); ++k) {
        const double expected = exact(times[k]);
        EXPECT_NEAR(solution.x(1, static_cast<Index>(k)), expected, std::min(tolerance, 1e-12) * expected) << fast;
        EXPECT_NEAR(solution.x(0, static_cast<Index>(k)), settled, tolerance * 0.5) << fast;
      }
    }
  }
}

// The figure is never below a third of the error, nor far above it.
TEST(EventUnitsTest, EstimatesHold) {
  std::vector<double> ratios;
  for (unsigned seed = 101; seed <= 130; ++seed) {
    const RandomSystem system = MakeRandom(seed, 3, 4);
    const std::vector<double> times = Times(4, 64);
    const Solution best = SolveInUnitsAt(system.problem, 1e-13, times);
    for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
      const Solution solution = SolveInUnitsAt(system.problem, tolerance, times);
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      const double error = std::max(RelativeError(solution.x, best.x), 4e-15);
      const double figure = testing::FigureOf(solution.accuracy.errors.x);
      EXPECT_GT(figure, error / 3) << seed << " at " << tolerance;
      EXPECT_LE(error, tolerance) << seed;
      ratios.push_back(figure / error);
    }
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  EXPECT_LT(ratios[ratios.size() / 2], 30);
}

// What the data do not determine is said with its figure: the eigenvalue -1 of a rotated matrix with another of -1e9.
TEST(EventUnitsTest, SaysWhereTheDataDoNotDetermineTheAnswer) {
  const double c = 0.8, s = 0.6, fast = 1e9;
  Problem problem;
  problem.A = Matrix{{-(c * c * fast + s * s), -c * s * (fast - 1)}, {-c * s * (fast - 1), -(s * s * fast + c * c)}};
  problem.B = Matrix::Zero(2, 1);
  problem.N = Matrix::Zero(1, 2);
  problem.M = Matrix::Ones(1, 1);
  problem.f = TimeFunction::Zero(2);
  problem.g = TimeFunction::Constant(Vector::Ones(1));
  problem.x0 = Vector{{s, -c}};
  problem.horizon = 3;
  const Solution solution = SolveInUnitsAt(problem, 1e-10, Times(3, 3));
  const double error = MaxAbs(solution.x.col(2) - std::exp(-3.0) * problem.x0);
  EXPECT_GE(solution.accuracy.error * solution.certificate.x_scale, error / 3);
  EXPECT_FALSE(JudgeSolution(solution).success);
}

}  // namespace
}  // namespace dlcs
