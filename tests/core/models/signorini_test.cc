// SPDX-License-Identifier: Apache-2.0
#include "core/models/signorini.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "core/linalg/norms.h"
#include "core/matrix_classes/matrix_class.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using std::numbers::pi;
using testing::SolveToEnd;

Problem Signorini(const SignoriniModel& model) {
  auto problem = MakeSignoriniProblem(model);
  EXPECT_TRUE(problem.ok()) << problem.status();
  return *std::move(problem);
}

TEST(SignoriniTest, HasTheEigenvaluesOfTheDiscreteLaplacian) {
  const SignoriniModel model{.cells = 6, .coefficient = 0.5};
  const Problem problem = Signorini(model);
  const Index size = model.cells - 1;
  for (Index j = 1; j <= size; ++j) {
    for (Index k = 1; k <= size; ++k) {
      Vector v(size * size);
      for (Index q = 0; q < size; ++q) {
        for (Index p = 0; p < size; ++p) {
          v(q * size + p) =
              std::sin(pi * static_cast<double>(j * (p + 1)) / 6) * std::sin(pi * static_cast<double>(k * (q + 1)) / 6);
        }
      }
      const double s = std::sin(pi * static_cast<double>(j) / 12), r = std::sin(pi * static_cast<double>(k) / 12);
      EXPECT_LE(MaxAbs(problem.A * v + 0.5 * 36 * 4 * (s * s + r * r) * v), 1e-12);
    }
  }
  const MatrixClass matrix_class = Classify(problem.M);
  EXPECT_TRUE(matrix_class.z.yes());
  EXPECT_TRUE(matrix_class.p.yes());
}

// V = sinh(π(1 - x1)) sin πx2 is harmonic, 0 on the three sides, and ∂V/∂ν = π cosh(π) sin πx2 on the
// membrane: with y = V(0, ·) the discrete system has to say so with second order.
TEST(SignoriniTest, DiscretizesTheHarmonicFunctionsWithSecondOrder) {
  const auto errors = [](Index cells) {
    const Problem problem = Signorini({.cells = cells, .coefficient = 1, .psi_middle = "0", .psi_sides = "0"});
    const Index size = cells - 1;
    const auto dx = 1 / static_cast<double>(cells);
    Vector x(size * size), y(size), flux(size);
    for (Index q = 0; q < size; ++q) {
      const double s = std::sin(pi * dx * static_cast<double>(q + 1));
      y(q) = std::sinh(pi) * s;
      flux(q) = pi * std::cosh(pi) * s;
      for (Index p = 0; p < size; ++p) x(q * size + p) = std::sinh(pi * (1 - dx * static_cast<double>(p + 1))) * s;
    }
    const double inside = MaxAbs(problem.A * x + problem.B * y) / MaxAbs(x);
    const double membrane = MaxAbs((problem.N * x + problem.M * y) / (2 * dx) - flux);
    return std::pair(inside, membrane);
  };
  const auto [inside, membrane] = errors(8);
  const auto [inside_fine, membrane_fine] = errors(16);
  EXPECT_NEAR(inside / inside_fine, 4, 0.5) << inside;
  EXPECT_NEAR(membrane / membrane_fine, 4, 0.5) << membrane;
  EXPECT_LT(membrane_fine, 0.02 * pi * std::cosh(pi));
}

// V = sinh(√2 π(1 - x1)) sin πx2 sin πx3 likewise.
TEST(SignoriniTest, DiscretizesTheHarmonicFunctionsOfTheCube) {
  const auto error = [](Index cells) {
    const Problem problem =
        Signorini({.cells = cells, .dimensions = 3, .coefficient = 1, .psi_middle = "0", .psi_sides = "0"});
    const Index size = cells - 1;
    const double dx = 1 / static_cast<double>(cells), rate = std::sqrt(2) * pi;
    Vector x(size * size * size), y(size * size), flux(size * size);
    for (Index k = 0; k < size * size; ++k) {
      const double s =
          std::sin(pi * dx * static_cast<double>(k % size + 1)) * std::sin(pi * dx * static_cast<double>(k / size + 1));
      y(k) = std::sinh(rate) * s;
      flux(k) = rate * std::cosh(rate) * s;
      for (Index p = 0; p < size; ++p) x(k * size + p) = std::sinh(rate * (1 - dx * static_cast<double>(p + 1))) * s;
    }
    EXPECT_LE(MaxAbs((problem.N * x + problem.M * y) / (2 * dx) - flux), 10 * dx * dx * MaxAbs(flux));
    return MaxAbs(problem.A * x + problem.B * y) / MaxAbs(x);
  };
  EXPECT_NEAR(error(6) / error(12), 4, 0.6);
}

TEST(SignoriniTest, TheCubeIsSolvedByModesAndDensely) {
  const Problem problem = Signorini({.cells = 6, .dimensions = 3, .coefficient = 0.1, .horizon = 0.5});
  Options options;
  options.num_steps = 100;
  options.method = Method::kExponentialIntegrator;
  options.propagator = PropagatorKind::kKroneckerSum;
  const Solution modes = SolveToEnd(problem, options);
  options.propagator = PropagatorKind::kDense;
  const Solution dense = SolveToEnd(problem, options);
  EXPECT_LE(MaxAbs(modes.x - dense.x), 1e-12 * MaxAbs(dense.x));
  EXPECT_GT(dense.y.maxCoeff(), 0);
}

TEST(SignoriniTest, IterationMarchAndPaperAgreeAsInSectionFour) {
  for (const double coefficient : {2e-4, 2e-2}) {
    const SignoriniModel model{.cells = 8, .coefficient = coefficient, .horizon = 1};
    const Problem problem = Signorini(model);
    Options options;
    options.num_steps = 100;
    options.method = Method::kExponentialIntegrator;
    const Solution march = SolveToEnd(problem, options);
    options.method = Method::kLaplaceIteration;
    options.window_steps = Options::kWholeHorizon;
    const Solution iteration = SolveToEnd(problem, options);
    EXPECT_LE(MaxAbs(iteration.x - march.x), 1e-10);
    EXPECT_LE(iteration.certificate.node_residual, 1e-10);
    // The printed stop (4.8): min{h, Δx²}/10 from the converged solution, here by the contour with its P
    // = 25.
    options.method = Method::kWuChenIteration;
    options.iteration_tolerance = 1e-4;
    const Solution paper = SolveToEnd(problem, options);
    EXPECT_LE(MaxAbs(paper.x - march.x), 1e-3) << coefficient;
    // The membrane works both ways: solvent flows somewhere, and is shut off elsewhere.
    EXPECT_GT(march.y.maxCoeff(), 0.1);
    EXPECT_EQ(march.y.minCoeff(), 0);
  }
}

TEST(SignoriniTest, KroneckerSumAndDenseMatricesAgree) {
  for (const double coefficient : {2e-4, 2e-2}) {
    Problem problem = Signorini({.cells = 16, .coefficient = coefficient, .horizon = 1});
    problem.break_points = {0.3, 0.71};  // runs of three lengths, and states between them
    Options options;
    options.num_steps = 100;
    options.method = Method::kExponentialIntegrator;
    options.propagator = PropagatorKind::kDense;
    const Solution dense = SolveToEnd(problem, options);
    EXPECT_EQ(dense.propagator.used, PropagatorKind::kDense);
    options.propagator = PropagatorKind::kAuto;
    const Solution solution = SolveToEnd(problem, options);
    EXPECT_EQ(solution.propagator.used, PropagatorKind::kKroneckerSum) << solution.propagator.reason;
    EXPECT_EQ(solution.times, dense.times);
    EXPECT_LE(MaxAbs(solution.x - dense.x), 1e-12 * MaxAbs(dense.x));
    EXPECT_LE(MaxAbs(solution.y - dense.y), 1e-12 * MaxAbs(dense.y));
    EXPECT_LE(solution.certificate.node_residual, 1e-12 * solution.certificate.lcp_scale);
    EXPECT_NEAR(solution.certificate.midpoint_residual, dense.certificate.midpoint_residual, 1e-11);
    EXPECT_NEAR(solution.certificate.ode_defect, dense.certificate.ode_defect, 1e-12);
    options.output_times = {0, 0.5, 1};
    options.output_times_only = true;
    const Solution few = SolveToEnd(problem, options);
    ASSERT_EQ(few.times.size(), 3u);
    EXPECT_EQ(few.x.col(0), problem.x0);
  }
}

TEST(SignoriniTest, IterationAndMarchAgreeWithoutStates) {
  for (const double coefficient : {2e-4, 2e-2}) {
    Problem problem = Signorini({.cells = 32, .coefficient = coefficient, .horizon = 1});
    problem.break_points = {0.3};
    Options options;
    options.num_steps = 100;
    options.method = Method::kExponentialIntegrator;
    const Solution march = SolveToEnd(problem, options);
    options.method = Method::kLaplaceIteration;
    Index plain = 0;
    for (const Index window : {Index{0}, Index{7}, Options::kWholeHorizon}) {
      for (const int acceleration : {0, 5}) {
        options.window_steps = window;
        options.acceleration = acceleration;
        const Solution iteration = SolveToEnd(problem, options);
        EXPECT_EQ(iteration.propagator.used, PropagatorKind::kKroneckerSum);
        EXPECT_LE(MaxAbs(iteration.x - march.x), 1e-11 * MaxAbs(march.x)) << window << " " << acceleration;
        EXPECT_LE(MaxAbs(iteration.y - march.y), 1e-10 * MaxAbs(march.y)) << window << " " << acceleration;
        EXPECT_LE(iteration.certificate.node_residual, 1e-11 * iteration.certificate.lcp_scale);
        if (acceleration == 0) plain = iteration.cost.iterations;
        if (acceleration > 0 && window == Options::kWholeHorizon) {
          constexpr Index kConfirmation = 1;
          EXPECT_LT(iteration.cost.iterations - kConfirmation, plain) << coefficient;
        }
      }
    }
  }
}

TEST(SignoriniTest, ThreadsDoNotChangeABit) {
  const Problem problem = Signorini({.cells = 48, .coefficient = 2e-3, .horizon = 1});
  for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration}) {
    Options options;
    options.num_steps = 60;
    options.method = method;
    options.num_threads = 1;
    const Solution one = SolveToEnd(problem, options);
    options.num_threads = 2;
    const Solution two = SolveToEnd(problem, options);
    EXPECT_EQ(one.x, two.x);
    EXPECT_EQ(one.y, two.y);
  }
}

TEST(SignoriniTest, NamesWhatIsWrong) {
  const auto message = [](const SignoriniModel& model) {
    return std::string(MakeSignoriniProblem(model).status().message());
  };
  EXPECT_EQ(message({.cells = 1}), "cells: is 1, must be from 2 to 4096");
  EXPECT_EQ(message({.coefficient = -1}), "coefficient: is -1, must be positive and finite");
  EXPECT_EQ(message({.horizon = std::nan("")}), "horizon: is nan, must be positive and finite");
  EXPECT_NE(message({.psi_middle = "sin(t"}).find("f.of["), std::string::npos);
}

}  // namespace
}  // namespace dlcs
