// SPDX-License-Identifier: Apache-2.0
// The same system in other units of its states, pairs and time: powers of two must not matter to any march.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/context/certificate.h"
#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/linalg/norms.h"
#include "tests/support/random_matrix.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;
using testing::SolveToEnd;

// Exponents: x_i counts 2^{states[i]} times as much, y_i, w_i and t alike.
struct Units {
  std::vector<int> states, y, w;
  int time = 0;
};

Matrix Scaled(Matrix matrix, const std::vector<int>& rows, const std::vector<int>& columns) {
  for (Index j = 0; j < matrix.cols(); ++j) {
    for (Index i = 0; i < matrix.rows(); ++i) matrix(i, j) = std::ldexp(matrix(i, j), rows[i] - columns[j]);
  }
  return matrix;
}

// phase + sin(frequency t) times a power of two.
std::string Formula(double phase, double frequency, int exponent, int time) {
  return "2^(" + std::to_string(exponent) + ")*(" + std::to_string(phase) + "+sin(" + std::to_string(frequency) +
         "*2^(" + std::to_string(-time) + ")*t))";
}

constexpr Index kStates = 4, kPairs = 3;

// A stable system with a P-matrix, whose pairs switch.
Problem System(unsigned seed, const Units& units) {
  Problem problem;
  Matrix A = RandomMatrix(kStates, kStates, seed);
  A.diagonal().array() -= 3;
  A.row(0) *= 1e3;
  const Matrix M = 3 * Matrix::Identity(kPairs, kPairs) + 0.5 * RandomMatrix(kPairs, kPairs, seed + 1);
  const double per_time = std::ldexp(1.0, -units.time);
  problem.A = Matrix(per_time * Scaled(A, units.states, units.states));
  problem.B = Matrix(per_time * Scaled(RandomMatrix(kStates, kPairs, seed + 2), units.states, units.y));
  problem.N = Scaled(RandomMatrix(kPairs, kStates, seed + 3), units.w, units.states);
  problem.M = Scaled(M, units.w, units.y);
  std::vector<std::string> f, g;
  for (Index i = 0; i < kStates; ++i) f.push_back(Formula(0.5, 1.0 + i, units.states[i] - units.time, units.time));
  for (Index i = 0; i < kPairs; ++i) g.push_back(Formula(0.1, 2.0 + i, units.w[i], units.time));
  problem.f = TimeFunction::Formulas(f);
  problem.g = TimeFunction::Formulas(g);
  problem.x0 = Scaled(RandomMatrix(kStates, 1, seed + 4), units.states, {0});
  problem.horizon = std::ldexp(4.0, units.time);
  return problem;
}

TEST(UnitsTest, PowersOfTwoDoNotMatterToTheMarches) {
  const Units even{{0, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0};
  const std::vector<Units> others = {{{20, -13, 0, 7}, {0, 0, 0}, {0, 0, 0}, 0},
                                     {{0, 0, 0, 0}, {5, -20, 11}, {-3, 9, 17}, 0},
                                     {{0, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}, -30},
                                     {{-27, 26, 3, -11}, {14, 2, -19}, {6, -21, 8}, 17}};
  for (const Method method : {Method::kExponentialIntegrator, Method::kTimeStepping, Method::kLaplaceIteration}) {
    Options options;
    options.method = method;
    options.num_steps = 200;
    options.estimate_error = false;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const Solution reference = SolveToEnd(System(10 * seed, even), options);
      for (const Units& units : others) {
        const Solution scaled = SolveToEnd(System(10 * seed, units), options);
        ASSERT_EQ(scaled.x.cols(), reference.x.cols());
        // The iteration stops at 1e-10 of each row's size, wherever it is then.
        const double tolerance = method == Method::kLaplaceIteration ? 1e-9 : 1e-13;
        for (Index i = 0; i < kStates; ++i) {
          const double unit = std::ldexp(1.0, -units.states[i]);
          EXPECT_LE(MaxAbs(unit * scaled.x.row(i) - reference.x.row(i)), tolerance * MaxAbs(reference.x.row(i)))
              << MethodName(method) << " " << seed;
        }
        for (Index i = 0; i < kPairs; ++i) {
          const double unit = std::ldexp(1.0, -units.y[i]);
          EXPECT_LE(MaxAbs(unit * scaled.y.row(i) - reference.y.row(i)), tolerance * MaxAbs(reference.y.row(i)))
              << MethodName(method) << " " << seed;
        }
        const Certificate &of_scaled = scaled.certificate, &of_reference = reference.certificate;
        EXPECT_LE(of_scaled.node_residual_of_rows, 1e-9);
        if (method == Method::kLaplaceIteration)
          continue;  // its windows differ, and what is known of sizes at their ends
        EXPECT_NEAR(of_scaled.midpoint_residual_of_rows, of_reference.midpoint_residual_of_rows, 1e-9);
        EXPECT_NEAR(of_scaled.drift_of_rows, of_reference.drift_of_rows, 1e-9);
      }
    }
  }
}

// x' = A x with eigenvalues -100 and -1, rotated, in states 2⁵³ apart; and with -2²⁰ and -1.
TEST(UnitsTest, StatesMayBeFarApartHoweverFastOneOfThemIs) {
  for (const double fast : {100.0, 0x1p20}) {
    const Units units{{26, -27}, {0}, {0}, 0};
    Matrix rotation(2, 2);
    rotation << 0.6, -0.8, 0.8, 0.6;
    const Vector rates{{-fast, -1}};
    Problem problem;
    problem.A = Scaled(rotation * rates.asDiagonal() * rotation.transpose(), units.states, units.states);
    problem.B = Matrix(Matrix::Zero(2, 1));
    problem.N = Matrix(Matrix::Zero(1, 2));
    problem.M = Matrix(Matrix::Identity(1, 1));
    problem.f = TimeFunction::Zero(2);
    problem.g = TimeFunction::Constant(Vector::Ones(1));
    problem.x0 = Scaled(rotation.col(1), units.states, {0});
    problem.horizon = 3;
    for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration, Method::kTimeStepping}) {
      Options options;
      options.method = method;
      options.num_steps = 1000;
      options.estimate_error = false;
      const Solution solution = SolveToEnd(problem, options);
      const Vector quotient = solution.x.col(1000).cwiseQuotient(problem.x0);
      const double decay = method == Method::kTimeStepping ? std::pow(1 + 0.003, -1000) : std::exp(-3);
      EXPECT_NEAR(quotient[0] / decay, 1, fast * 1e-15 + 1e-12) << MethodName(method);
      EXPECT_NEAR(quotient[1] / decay, 1, fast * 1e-15 + 1e-12) << MethodName(method);
    }
  }
}

// A scheme that decays 5 % too fast agrees with itself at its midpoints; what it adds up to does not.
TEST(UnitsTest, TheDriftSeesWhatMidpointsShareWithNodes) {
  Problem problem;
  problem.A = Matrix(Vector{{-1, -1e-6}}.asDiagonal());
  problem.B = Matrix(Matrix::Zero(2, 1));
  problem.N = Matrix(Matrix::Zero(1, 2));
  problem.M = Matrix(Matrix::Identity(1, 1));
  Problem wrong = problem;
  wrong.A = Matrix(Vector{{-1.05, -1e-6}}.asDiagonal());
  for (const Problem* made_by : {&problem, &wrong}) {
    const Scheme scheme = ExponentialPiecewiseLinear(*made_by, 0.01);
    Segment segment;
    segment.steps = 100;
    segment.step = 0.01;
    segment.x = Matrix(2, 101);
    segment.x.col(0) << 1, 1e9;  // the other state is large, and right
    for (Index j = 1; j <= 100; ++j) segment.x.col(j) = scheme.state * segment.x.col(j - 1);
    segment.y = Matrix::Zero(1, 101);
    segment.g = Matrix::Ones(1, 101);
    segment.g_mid = Matrix::Ones(1, 100);
    segment.f = Matrix::Zero(2, 101);
    segment.f_mid = Matrix::Zero(2, 100);
    CertificateBuilder builder(problem);
    builder.Add(segment, segment.g, scheme, 0, 100);
    const Certificate& certificate = builder.certificate();
    EXPECT_EQ(certificate.ode_defect, 0);
    EXPECT_EQ(certificate.midpoint_residual_of_rows, 0);
    if (made_by == &problem) {
      EXPECT_LE(certificate.drift_of_rows, 1e-10);
    } else {
      EXPECT_NEAR(certificate.drift_of_rows, 0.05 * (1 - std::exp(-1.05)) / 1.05, 1e-3);
    }
  }
}

}  // namespace
}  // namespace dlcs
