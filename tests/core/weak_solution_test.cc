// SPDX-License-Identifier: Apache-2.0
// Theorem 7 (b), (c) of [Shen & Pang 2007]: for M = 0 and NB strictly semicopositive the interpolants of the scheme
// (6)-(9), x piecewise linear and y piecewise constant, converge to a weak solution, x uniformly and y weakly in L².

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "core/event_driven/interpolant.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/semicopositive.h"
#include "tests/support/index_one_problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

// x1' = x2 + y, x2' = x3, x3' = -x2, 0 <= y ⟂ x1 >= 0 from (1/2, 1, 0): without y x1 would be 1/2 + sin t, so
// y = -cos t on [7π/6, 3π/2] and 0 elsewhere, and x1 = 1/2 + sin t + (max(0, -min over [0, t] of 1/2 + sin)).
constexpr double kContact = 7 * std::numbers::pi / 6, kRelease = 3 * std::numbers::pi / 2;
Problem Swing() {
  IndexOneSystem system{Matrix::Zero(3, 3), Vector::Unit(3, 0), Vector::Unit(3, 0).transpose()};
  system.A(0, 1) = system.A(1, 2) = 1;
  system.A(2, 1) = -1;
  return testing::IndexOneProblem(system, Vector{{0.5, 1, 0}}, 6);
}
Vector SwingState(double t) {
  const double lift = t < kContact ? 0 : t < kRelease ? -0.5 - std::sin(t) : 0.5;
  return Vector{{0.5 + std::sin(t) + lift, std::cos(t), -std::sin(t)}};
}
double SwingForce(double t) { return t > kContact && t < kRelease ? -std::cos(t) : 0; }

Problem ThreeContacts() { return testing::IndexOneProblem(testing::ThreeContacts(), testing::ThreeContactsStart(), 6); }

Solution March(const Problem& problem, Index steps, Method method = Method::kTimeStepping) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  return testing::SolveToEnd(problem, options);
}

using TestFunction = std::function<double(double)>;
const std::vector<TestFunction> kTestFunctions = {[](double) { return 1.0; },
                                                  [](double t) { return t * t; },
                                                  [](double t) { return std::cos(3 * t); },
                                                  [](double t) { return std::sin(20 * t); },
                                                  [](double t) { return t > 1.3 && t < 4.1 ? 1.0 : 0.0; },
                                                  [](double t) { return std::pow(std::abs(t - 4), -0.3); }};

// ∫ y_i φ dt by the midpoint rule on `cells` cells, columns are the test functions.
Matrix WeakIntegrals(Index size, double horizon, int cells, const std::function<Vector(double)>& y) {
  Matrix integrals = Matrix::Zero(size, static_cast<Index>(kTestFunctions.size()));
  const double width = horizon / cells;
  for (int k = 0; k < cells; ++k) {
    const double t = (k + 0.5) * width;
    const Vector value = y(t);
    for (Index j = 0; j < integrals.cols(); ++j) integrals.col(j) += width * kTestFunctions[j](t) * value;
  }
  return integrals;
}
constexpr int kCells = 60000;

TEST(WeakSolutionTest, StatesConvergeUniformlyAndForcesWeaklyToTheClosedForm) {
  const Problem problem = Swing();
  ASSERT_TRUE(TestStrictlySemicopositive(problem.N * problem.B).yes());
  const Matrix exact =
      WeakIntegrals(1, problem.horizon, kCells, [](double t) { return Vector::Constant(1, SwingForce(t)); });
  double last_x = 0, last_y = 0;
  for (const Index steps : {250, 1000, 4000}) {
    const Solution solution = March(problem, steps);
    auto interpolant = Interpolant::Create(problem, solution);
    ASSERT_TRUE(interpolant.ok());
    double error_x = 0, error_y = 0;
    for (int k = 0; k <= 20000; ++k) {
      const double t = problem.horizon * k / 20000;
      const auto point = interpolant->At(t);
      error_x = std::max(error_x, MaxAbs(point.x - SwingState(t)));
      error_y = std::max(error_y, std::abs(point.y[0] - SwingForce(t)));
    }
    const double weak =
        MaxAbs(WeakIntegrals(1, problem.horizon, kCells, [&](double t) { return interpolant->At(t).y; }) - exact);
    if (last_x > 0) {
      EXPECT_LT(error_x, last_x / 3.5) << steps;
      EXPECT_LT(weak, last_y / 3.5) << steps;
    }
    last_x = error_x;
    last_y = weak;
    EXPECT_GT(error_y, 0.5) << "the force jumps at the contact: it does not converge uniformly";
  }
  EXPECT_LT(last_x, 0.02);
  EXPECT_LT(last_y, 0.01 * MaxAbs(exact));
}

// ∫_0^t of the piecewise linear and constant interpolants at every node: what (5) asks of a weak solution.
struct WeakDefects {
  double equation = 0;         // max over nodes of ‖x(t) - x0 - ∫(A x + B y)‖
  double complementarity = 0;  // |∫ yᵀN x|
  double least_w = 0;
};
WeakDefects DefectsOf(const Problem& problem, const Solution& solution) {
  WeakDefects defects;
  Vector integral = Vector::Zero(problem.num_states());
  for (Index k = 1; k < solution.x.cols(); ++k) {
    const double h = solution.times[k] - solution.times[k - 1];
    const Vector x_mean = (solution.x.col(k - 1) + solution.x.col(k)) / 2, y = solution.y.col(k);
    integral += h * (problem.A * x_mean + problem.B * y);
    defects.equation = std::max(defects.equation, MaxAbs(solution.x.col(k) - problem.x0 - integral));
    defects.complementarity += h * y.dot(problem.N * x_mean);
    defects.least_w = std::min(defects.least_w, (problem.N * solution.x.col(k)).minCoeff());
  }
  defects.complementarity = std::abs(defects.complementarity);
  return defects;
}

TEST(WeakSolutionTest, TheLimitIsAWeakSolution) {
  for (const Problem& problem : {Swing(), ThreeContacts()}) {
    ASSERT_TRUE(TestStrictlySemicopositive(problem.N * problem.B).yes());
    WeakDefects last;
    for (const Index steps : {300, 1200, 4800}) {
      const Solution solution = March(problem, steps);
      const WeakDefects defects = DefectsOf(problem, solution);
      EXPECT_GT(MaxAbs(solution.y), 0.5);
      EXPECT_GE(defects.least_w, -1e-12);
      if (steps > 300) {
        EXPECT_LT(defects.equation, last.equation / 3.5) << steps;
        EXPECT_LT(defects.complementarity, last.complementarity / 3) << steps;
      }
      last = defects;
    }
    EXPECT_LT(last.equation, 0.02);
    EXPECT_LT(last.complementarity, 0.02);
  }
}

// The same limit as that of a scheme of another kind, exp-PC.
TEST(WeakSolutionTest, AgreesWithAnotherSchemeInTheLimit) {
  const Problem problem = ThreeContacts();
  double last_x = 0, last_y = 0;
  for (const Index steps : {300, 1200, 4800}) {
    const Solution euler = March(problem, steps), exact = March(problem, steps, Method::kExponentialIntegrator);
    auto a = Interpolant::Create(problem, euler), b = Interpolant::Create(problem, exact);
    ASSERT_TRUE(a.ok() && b.ok());
    const double difference_x = MaxAbs(euler.x - exact.x);
    const auto y_of = [](Interpolant& interpolant) {
      return [&](double t) { return interpolant.Limit(t, Side::kLeft).y; };
    };
    const double difference_y =
        MaxAbs(WeakIntegrals(3, problem.horizon, 9600, y_of(*a)) - WeakIntegrals(3, problem.horizon, 9600, y_of(*b)));
    if (last_x > 0) {
      EXPECT_LT(difference_x, last_x / 3) << steps;
      EXPECT_LT(difference_y, last_y / 3) << steps;
    }
    last_x = difference_x;
    last_y = difference_y;
  }
  EXPECT_LT(last_x, 0.02);
}

}  // namespace
}  // namespace dlcs
