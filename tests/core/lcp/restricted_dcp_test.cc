// SPDX-License-Identifier: Apache-2.0
#include "tests/support/restricted_dcp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "core/solve.h"
#include "tests/support/example_10.h"
#include "tests/support/index_one_problems.h"

namespace dlcs {
namespace {

using testing::ExampleTenSystem;

const Vector kDrivenStart = testing::ThreeContactsStart();

RestrictedDcpSolution Solved(const IndexOneSystem& system, const Vector& x0, double t_hat, Index steps) {
  auto solution = SolveRestrictedDcp(system, x0, t_hat, steps);
  EXPECT_TRUE(solution.ok()) << solution.status();
  if (!solution.ok()) return {};
  EXPECT_TRUE(solution->solved) << solution->message;
  return *std::move(solution);
}

// v = ∫y by the implicit Euler steps of the system itself, (6)-(9).
Matrix EulerIntegral(const IndexOneSystem& system, const Vector& x0, double t_hat, Index steps) {
  Options options;
  options.method = Method::kTimeStepping;
  options.num_steps = steps;
  Observer silent;
  const auto solution = Solve(testing::IndexOneProblem(system, x0, t_hat), options, silent, {});
  EXPECT_TRUE(solution.ok() && solution->termination == Termination::kReachedEnd);
  Matrix v = Matrix::Zero(system.C.rows(), steps + 1);
  for (Index j = 1; j <= steps; ++j) {
    v.col(j) = v.col(j - 1) + (solution->times[j] - solution->times[j - 1]) * solution->y.col(j);
  }
  return v;
}

TEST(RestrictedDcpTest, FindsTheEvenSolutionOfExampleTen) {
  const Vector x0{{0, 0, 0, 1}};
  const RestrictedDcpSolution solution = Solved(ExampleTenSystem(), x0, 8, 100);
  const PiecewiseLinearPath even = ExampleTenEvenSolution(8);
  EXPECT_LT(MaxAbs(solution.v.values.rightCols(1) - even.values.rightCols(1)), 1e-13);
  EXPECT_LT(solution.certificate.complementarity, 1e-13);
  EXPECT_LT(MaxAbs(solution.v.values - EulerIntegral(ExampleTenSystem(), x0, 8, 100)), 1e-13);
  // There q is -t and CΦ = 0: (12) is the DCP of the paper.
  EXPECT_LT(MaxAbs(solution.dcp.q.values.rightCols(1) + Vector::Constant(3, 8)), 1e-13);
}

TEST(RestrictedDcpTest, AgreesWithTimeSteppingOfTheSystemInTheLimit) {
  const IndexOneSystem system = testing::ThreeContacts();
  double last_difference = 0, last_complementarity = 0;
  for (const Index steps : {150, 600, 2400}) {
    const RestrictedDcpSolution solution = Solved(system, kDrivenStart, 4, steps);
    const double difference = MaxAbs(solution.v.values - EulerIntegral(system, kDrivenStart, 4, steps));
    EXPECT_GE(solution.certificate.least_increase, 0);
    EXPECT_GE(solution.certificate.least_w, -1e-12);
    if (last_difference > 0) {
      EXPECT_LT(difference, last_difference / 3.3) << steps;
      EXPECT_LT(solution.certificate.complementarity, last_complementarity / 3) << steps;
    }
    last_difference = difference;
    last_complementarity = solution.certificate.complementarity;
    EXPECT_GT(MaxAbs(solution.v.values), 0.5);
  }
  EXPECT_LT(last_difference, 1e-2);
}

// v is a fixed point: DCP(q + Φ(·, v'), CB), solved for that path alone, gives v back.
TEST(RestrictedDcpTest, IsAFixedPointOfTheDcp) {
  const RestrictedDcpSolution solution = Solved(testing::ThreeContacts(), kDrivenStart, 4, 300);
  const auto again = SolveDcp(solution.dcp, 1e9);
  ASSERT_TRUE(again.ok());
  ASSERT_TRUE(again->solved) << again->message;
  EXPECT_TRUE(again->unique.yes());
  EXPECT_LT(MaxAbs(again->v.values - solution.v.values), 1e-11);
}

// Lemma 8 by parts: Φ(t, v') = ∫_0^t C A e^{A(t-τ)} B v(τ) dτ, here by Simpson's rule; and its bound.
TEST(RestrictedDcpTest, MemoryIsPhiOfLemmaEight) {
  const IndexOneSystem system = testing::ThreeContacts();
  const double t_hat = 1.5;
  const Index steps = 60;
  const RestrictedDcpSolution solution = Solved(system, kDrivenStart, t_hat, steps);
  const double h = t_hat / static_cast<double>(steps);
  const auto kernel = [&](double t) -> Matrix {
    return system.C * system.A * ComputePhiFunctions(t * system.A).phi0 * system.B;
  };
  for (const Index j : {20, 40, 60}) {
    const double t = solution.v.times[j];
    Vector integral = Vector::Zero(3);
    for (Index l = 1; l <= j; ++l) {
      const Vector begin = solution.v.values.col(l - 1), end = solution.v.values.col(l);
      const double s = solution.v.times[l - 1];
      integral += h / 6 * (kernel(t - s) * begin + kernel(t - s - h) * end + 2 * kernel(t - s - h / 2) * (begin + end));
    }
    const Vector q = system.C * ComputePhiFunctions(t * system.A).phi0 * kDrivenStart;
    const Vector phi = solution.dcp.q.values.col(j) - q;
    EXPECT_LT(MaxAbs(phi - integral), 1e-8) << t;
    EXPECT_GT(MaxAbs(phi), 1e-3) << t;
    EXPECT_LE(MaxAbs(phi), PhiBound(system, t) * MaxAbs(solution.v.values.col(j))) << t;
  }
}

TEST(RestrictedDcpTest, SaysWhatItRefusesAndWhereItFails) {
  const IndexOneSystem system = testing::ThreeContacts();
  for (const auto& result :
       {SolveRestrictedDcp(system, kDrivenStart, 0, 10), SolveRestrictedDcp(system, kDrivenStart, 1, 0),
        SolveRestrictedDcp(system, -kDrivenStart, 1, 10), SolveRestrictedDcp(system, Vector::Ones(2), 1, 10)}) {
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  }
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(SolveRestrictedDcp(system, kDrivenStart, 1, 10, source.get_token()).status().code(),
            absl::StatusCode::kCancelled);
  // x' = -u + 1 drift down to 0, where u > 0 pushes further: CB = -1.
  const IndexOneSystem wrong{Matrix{{0, -1}, {0, 0}}, Vector{{-1, 0}}, Vector{{1, 0}}.transpose()};
  const auto failed = SolveRestrictedDcp(wrong, Vector{{0.5, 1}}, 1, 10);
  ASSERT_TRUE(failed.ok());
  EXPECT_FALSE(failed->solved);
  EXPECT_EQ(failed->v.times.size(), 6u);  // until 0.5
  EXPECT_EQ(failed->v.values.cols(), 6);
}

}  // namespace
}  // namespace dlcs
