// SPDX-License-Identifier: Apache-2.0
#include "core/context/certificate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/problem/verdict.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

// A block with dry friction at rest, pushed by less than friction holds: x' = push + y1 - 1 with 0 <= y1 <= 2. x is 0
// but for rounding; it counts 2^exponent times as much as y.
Problem BlockAtRest(const std::string& push, int exponent) {
  const double unit = std::ldexp(1.0, exponent);
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = unit * (Matrix(1, 2) << 1, 0).finished();
  problem.N = (Matrix(2, 1) << 1 / unit, 0).finished();
  problem.M = (Matrix(2, 2) << 0, 1, -1, 0).finished();
  problem.f = TimeFunction::Formulas({"2^(" + std::to_string(exponent) + ")*((" + push + ")-1.0)"});
  problem.g = TimeFunction::Constant(Vector{{0, 2}});
  problem.x0 = Vector::Zero(1);
  problem.horizon = 20;
  return problem;
}

TEST(CertificateTest, ResidualsOfAStateAtRestAreNotRelativeToItsRounding) {
  for (const std::string push : {"sin(t)", "0.3*cos(3*t)+0.1*sin(0.7*t)", "0.7"}) {
    for (const int exponent : {0, 20, -10}) {
      for (const Method method : {Method::kExponentialIntegrator, Method::kTimeStepping}) {
        Options options;
        options.method = method;
        options.num_steps = 1000;
        const Solution solution = testing::SolveToEnd(BlockAtRest(push, exponent), options);
        EXPECT_LT(solution.x.cwiseAbs().maxCoeff(), std::ldexp(1e-15, exponent));
        EXPECT_LT(solution.certificate.node_residual_of_rows, 1e-12) << push << " " << exponent;
        EXPECT_LT(solution.certificate.midpoint_residual_of_rows, 0.01) << push << " " << exponent;
        EXPECT_TRUE(JudgeSolution(solution).success) << JudgeSolution(solution).text;
      }
    }
  }
}

// The reciprocals of such sizes overflow.
TEST(CertificateTest, ResidualsOfSubnormalRowsAreFinite) {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{1}};
  problem.N = Matrix{{-1}};
  problem.M = Matrix{{2}};
  problem.f = TimeFunction::Constant(Vector{{0}});
  problem.g = TimeFunction::Constant(Vector{{0}});
  problem.x0 = Vector{{1e-310}};
  problem.horizon = 2;
  Options options;
  options.method = Method::kTimeStepping;
  options.num_steps = 20;
  const Solution solution = testing::SolveToEnd(problem, options);
  EXPECT_TRUE(std::isfinite(solution.certificate.node_residual_of_rows));
  EXPECT_TRUE(std::isfinite(solution.certificate.midpoint_residual_of_rows));
}

// The same block moved by a part of what y moves in a step, and back: that is not rounding.
TEST(CertificateTest, ShowsThatAStateIsNotAtRest) {
  const Problem problem = BlockAtRest("0", 0);
  constexpr double kStep = 0.02, kPart = 0.4;
  Segment segment;
  segment.steps = 10;
  segment.step = kStep;
  segment.x = Matrix::Zero(1, 11);
  for (Index j = 1; j <= 9; j += 2) segment.x(0, j) = -kPart * kStep;
  segment.y = Vector{{1, 0}}.replicate(1, 11);
  segment.f = Matrix::Constant(1, 11, -1);
  segment.f_mid = Matrix::Constant(1, 10, -1);
  segment.g = Vector{{0, 2}}.replicate(1, 11);
  segment.g_mid = Vector{{0, 2}}.replicate(1, 10);
  const Matrix w = problem.N * segment.x + segment.g + problem.M * segment.y;
  CertificateBuilder builder(problem);
  builder.Add(segment, w, ExponentialPiecewiseConstant(problem, kStep), 0, 10);
  EXPECT_GT(builder.certificate().node_residual_of_rows, 0.2);
}

}  // namespace
}  // namespace dlcs
