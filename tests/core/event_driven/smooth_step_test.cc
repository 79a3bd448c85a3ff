// SPDX-License-Identifier: Apache-2.0
// Steps, and what they say of their errors, against closed forms.

#include "core/event_driven/smooth_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/discretization/sources.h"
#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

constexpr double kSmoothTolerance = 1e-6;

// x' = A x + f from x0, with one pair: w = Σ x_i + 1000 and M = 1, B = 0 if nothing else is said.
Problem SmoothProblem(const Matrix& A, const Vector& x0, std::vector<std::string> f, double horizon) {
  const Index m = A.rows();
  Problem problem;
  problem.A = A;
  problem.B = Matrix::Zero(m, 1);
  problem.N = Matrix::Ones(1, m);
  problem.M = Matrix::Identity(1, 1);
  problem.f = f.empty() ? TimeFunction::Zero(m) : TimeFunction::Formulas(std::move(f));
  problem.g = TimeFunction::Constant(Vector{{1000}});
  problem.x0 = x0;
  problem.horizon = horizon;
  return problem;
}

// A step from 0 with all that it needs, which it refers to.
struct SmoothRun {
  SmoothRun(const Problem& of, std::vector<Index> active, double length, double tolerance = kSmoothTolerance,
            double share = 1)
      : problem(of), magnitudes(problem, {}, tolerance) {
    const Index m = problem.num_states(), n = problem.num_constraints();
    mode = ModeMaker(problem).Make(std::move(active), {Vector::Ones(m), Vector::Ones(m), Vector::Ones(n)});
    absl::StatusOr<Sources> made = Sources::Create(problem);
    SourceSampler(*made).Sample(0, length, sources);
    step = TakeSmoothStep(std::make_shared<const ModeStepper>(*mode, length), problem.x0, sources, magnitudes,
                          tolerance, share, nullptr);
  }

  Problem problem;
  Magnitudes magnitudes;
  std::unique_ptr<Mode> mode;
  StepSources sources;
  SmoothStep step;
};

// The largest error of each row inside the step, of which `exact` has the values at times from 0 on.
Vector ErrorsInside(const LegendreSeries& series, double length, const std::function<Vector(double)>& exact) {
  constexpr int kLooks = 40;
  Vector errors = Vector::Zero(series.rows());
  for (int k = 0; k <= kLooks; ++k) {
    const double s = -1 + 2.0 * k / kLooks;
    errors = errors.cwiseMax((ValueOf(series, LegendreValues(s)) - exact(length * k / kLooks)).cwiseAbs());
  }
  return errors;
}

// Holds the estimates of x against its largest errors inside the step: not below a third of them, nor above a thousand
// times, but for rounding.
void ExpectEstimatesOf(const SmoothRun& run, const Vector& errors) {
  const Vector estimates = run.step.x_error.truncation + run.step.layer;
  for (Index i = 0; i < errors.size(); ++i) {
    EXPECT_LE(errors[i], 3 * estimates[i] + run.step.x_error.rounding[i]) << "state " << i;
    EXPECT_LE(estimates[i], 1e3 * errors[i] + run.step.x_error.rounding[i]) << "state " << i;
  }
}

// The same of the worst state, relative to what is allowed. By accident the last coefficients of one state may be small
// where those of others are not.
void ExpectRatioOf(const SmoothRun& run, const Vector& errors) {
  double ratio = 0, rounding = 0;
  for (Index i = 0; i < errors.size(); ++i) {
    const double allowed = kSmoothTolerance * std::max(run.step.x_size[i], std::abs(run.problem.x0[i]));
    ratio = std::max(ratio, errors[i] / allowed);
    rounding = std::max(rounding, run.step.x_error.rounding[i] / allowed);
  }
  EXPECT_LE(ratio, 3 * run.step.error_ratio + rounding);
  EXPECT_LE(run.step.error_ratio, 1e3 * ratio + rounding);
}

SmoothRun SmoothDecay(double rate_times_length, double tolerance = kSmoothTolerance, double share = 1) {
  return {SmoothProblem(Matrix{{-1}}, Vector{{1}}, {}, 100), {}, rate_times_length, tolerance, share};
}

SmoothRun SmoothGrowth(double rate_times_length) {
  return {SmoothProblem(Matrix{{1}}, Vector{{1}}, {}, 100), {}, rate_times_length};
}

TEST(SmoothStepTest, ShortStepsAreExactToRounding) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Matrix A = RandomMatrix(4, 4, seed);
    const Vector x0 = RandomMatrix(4, 1, seed + 100);
    const double length = 0.5 / InfinityNorm(A);
    const SmoothRun run(SmoothProblem(A, x0, {}, 1), {}, length);
    const Vector errors =
        ErrorsInside(run.step.x, length, [&](double t) { return Vector(ComputePhiFunctions(t * A).phi0 * x0); });
    for (Index i = 0; i < 4; ++i) EXPECT_LE(errors[i], 1e-14 * MaxAbs(x0)) << seed;
    EXPECT_LE(run.step.error_ratio, 1e-6) << seed;
    EXPECT_LE(MaxAbs(run.step.x_error.rounding), 1e-12 * MaxAbs(x0)) << seed;
  }
}

TEST(SmoothStepTest, EstimatesTheErrorOfAnExponential) {
  for (double z = 0.1; z < 1e6; z *= 1.3) {
    SCOPED_TRACE(z);
    const SmoothRun run = SmoothDecay(z);
    ExpectEstimatesOf(run, ErrorsInside(run.step.x, z, [](double t) { return Vector{{std::exp(-t)}}; }));
  }
  for (double z = 0.1; z <= 6; z *= 1.3) {  // no step grows more
    SCOPED_TRACE(z);
    const SmoothRun run = SmoothGrowth(z);
    ExpectEstimatesOf(run, ErrorsInside(run.step.x, z, [](double t) { return Vector{{std::exp(t)}}; }));
  }
}

TEST(SmoothStepTest, EstimatesTheErrorOfARotationOfAnyPhase) {
  int accurate = 0, rough = 0;
  for (double rate = 0.5; rate < 40; rate *= 1.2) {
    for (int k = 0; k < 12; ++k) {
      SCOPED_TRACE(::testing::Message() << rate << " from " << k);
      const double phase = 2 * std::numbers::pi * k / 12 + 0.01;
      const auto exact = [&](double t) { return Vector{{std::cos(rate * t + phase), -std::sin(rate * t + phase)}}; };
      const SmoothRun run(SmoothProblem(Matrix{{0, rate}, {-rate, 0}}, exact(0), {}, 1), {}, 1);
      const Vector errors = ErrorsInside(run.step.x, 1, exact);
      ExpectRatioOf(run, errors);
      if (run.step.error_ratio <= 1) ExpectEstimatesOf(run, errors);
      run.step.error_ratio <= 1 ? ++accurate : ++rough;
    }
  }
  EXPECT_GT(accurate, 50);
  EXPECT_GT(rough, 50);
}

TEST(SmoothStepTest, EstimatesTheWorstErrorOfASystem) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Matrix A = RandomMatrix(4, 4, seed) - 2.5 * Matrix::Identity(4, 4);
    const Vector x0 = RandomMatrix(4, 1, seed + 100);
    for (double length = 0.1; length < 6; length *= 1.7) {
      SCOPED_TRACE(::testing::Message() << seed << " over " << length);
      const SmoothRun run(SmoothProblem(A, x0, {}, length), {}, length);
      ExpectRatioOf(run, ErrorsInside(run.step.x, length,
                                      [&](double t) { return Vector(ComputePhiFunctions(t * A).phi0 * x0); }));
    }
  }
}

// x' = λ (x - cos(ω t)) - ω sin(ω t) from cos 0: the interpolation of the source, stiff or not.
TEST(SmoothStepTest, EstimatesTheErrorOfAForcedSystemStiffOrNot) {
  for (const int lambda : {-1, -100, -10000, -100000000}) {
    for (int rate = 1; rate < 30; rate += 2) {
      SCOPED_TRACE(::testing::Message() << lambda << ", " << rate);
      const std::string of = "(" + std::to_string(rate) + "*t)", by = std::to_string(rate);
      const SmoothRun run(SmoothProblem(Matrix{{static_cast<double>(lambda)}}, Vector{{1}},
                                        {std::to_string(-lambda) + "*cos" + of + " - " + by + "*sin" + of}, 1),
                          {}, 1);
      EXPECT_EQ(run.step.layer[0], 0);
      ExpectEstimatesOf(run, ErrorsInside(run.step.x, 1, [&](double t) { return Vector{{std::cos(rate * t)}}; }));
    }
  }
}

TEST(SmoothStepTest, TheTailVanishesAtTheEnd) {
  for (const double z : {3.0, 4.0, 5.0, 6.0}) {
    for (const double sign : {-1.0, 1.0}) {
      const SmoothRun run = sign > 0 ? SmoothGrowth(z) : SmoothDecay(z);
      const double at_end = std::abs(ValueOf(run.step.x, LegendreValues(1))[0] - std::exp(sign * z));
      EXPECT_GT(run.step.x_tail[0], run.step.x_error.rounding[0]) << z;
      EXPECT_LE(run.step.x_error.truncation[0], 1.001 * run.step.x_tail[0]) << z;  // there is nothing else
      EXPECT_LE(at_end, 0.01 * run.step.x_tail[0]) << z;
    }
  }
}

TEST(SmoothStepTest, KnowsWhichStepResolvesALayer) {
  for (const double fast : {1e4, 1e6, 1e9}) {
    // From 3 to the slow solution 1; the slow state beside it has no layer.
    const Problem problem = SmoothProblem(Matrix{{-fast, 0}, {0, -1}}, Vector{{3, 2}}, {std::to_string(fast), "0"}, 1);
    const SmoothRun run(problem, {}, 1);
    EXPECT_NEAR(run.step.layer[0], 2, 0.2);
    EXPECT_EQ(run.step.layer[1], 0);
    EXPECT_GT(run.step.error_ratio, 1e4);
    EXPECT_GE(run.step.layer_length, run.step.small_layer_length);
    ASSERT_NEAR(run.step.layer_length * fast, 8, 1e-6);
    const SmoothRun resolved(problem, {}, run.step.layer_length);
    EXPECT_EQ(resolved.step.layer[0], 0);
    ExpectEstimatesOf(resolved, ErrorsInside(resolved.step.x, run.step.layer_length, [&](double t) {
                        return Vector{{1 + 2 * std::exp(-fast * t), 2 * std::exp(-t)}};
                      }));
  }
}

// A layer that is little more than allowed may be one of rounding.
TEST(SmoothStepTest, ASmallLayerIsResolvedOnlyWhereAsked) {
  for (const double ratio : {20.0, 50.0}) {
    const Problem problem =
        SmoothProblem(Matrix{{-1e6}}, Vector{{1 + ratio * kSmoothTolerance}}, {std::to_string(1e6)}, 1);
    const SmoothRun run(problem, {}, 1);
    EXPECT_NEAR(run.step.error_ratio, ratio, 0.1 * ratio);
    EXPECT_NEAR(run.step.small_layer_length * 1e6, 8, 1e-6);
    EXPECT_EQ(std::isinf(run.step.layer_length), ratio < 32);
  }
}

// A state that starts at zero has no size yet: what counts is a millionth of what it may become.
TEST(SmoothStepTest, TheRatioOfAStateThatIsStillSmallIsThatBesideWhatItMayBecome) {
  const double ratio = SmoothDecay(6).step.error_ratio;
  SmoothRun run = SmoothDecay(6);
  run.problem.x0[0] = run.magnitudes.x[0] = 1e-12;
  run.magnitudes.x_reach[0] = 1;
  const SmoothStep small =
      TakeSmoothStep(run.step.stepper, run.problem.x0, run.sources, run.magnitudes, kSmoothTolerance, 1, nullptr);
  EXPECT_NEAR(small.error_ratio / ratio, 1e-6, 1e-8);
}

TEST(SmoothStepTest, TheRatioIsTheErrorBesideItsShareOfTheTolerance) {
  const double ratio = SmoothDecay(6).step.error_ratio;
  EXPECT_GT(ratio, 1e-3);
  EXPECT_NEAR(SmoothDecay(6, kSmoothTolerance / 2).step.error_ratio / ratio, 2, 1e-3);
  EXPECT_NEAR(SmoothDecay(6, kSmoothTolerance, 0.1).step.error_ratio / ratio, 10, 1e-3);
  // Beside the largest value so far.
  SmoothRun run = SmoothDecay(6);
  run.magnitudes.x[0] = 50;
  const SmoothStep later =
      TakeSmoothStep(run.step.stepper, run.problem.x0, run.sources, run.magnitudes, kSmoothTolerance, 1, nullptr);
  EXPECT_NEAR(later.error_ratio / ratio, 0.02, 1e-4);
}

TEST(SmoothStepTest, AStepThatIsNoNumberIsNotAccurate) {
  const SmoothRun run = SmoothDecay(1);
  const SmoothStep step = TakeSmoothStep(run.step.stepper, Vector{{std::nan("")}}, run.sources, run.magnitudes,
                                         kSmoothTolerance, 1, nullptr);
  EXPECT_FALSE(step.error_ratio <= 1);
}

TEST(SmoothStepTest, TheRatioHasNoUnits) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Matrix A = RandomMatrix(3, 3, seed) - Matrix::Identity(3, 3);
    const Vector x0 = RandomMatrix(3, 1, seed + 50), units{{1e5, 3e-7, 20}};
    const double time = 7e-6;
    const double length = 8 / InfinityNorm(A);
    Problem problem = SmoothProblem(A, x0, {}, 2 * length);
    const SmoothRun run(problem, {}, length);
    EXPECT_GT(run.step.error_ratio, 1e-6) << seed;
    problem.A = Matrix(units.asDiagonal() * A * units.cwiseInverse().asDiagonal() / time);
    problem.N = Matrix(1e4 * units.cwiseInverse().transpose());
    problem.g = TimeFunction::Constant(Vector{{1e7}});
    problem.x0 = units.cwiseProduct(x0);
    problem.horizon *= time;
    const SmoothRun other(problem, {}, time * length);
    EXPECT_NEAR(other.step.error_ratio / run.step.error_ratio, 1, 1e-3) << seed;
    for (Index i = 0; i < 3; ++i)
      EXPECT_NEAR(other.step.x_error.truncation[i] / units[i] / run.step.x_error.truncation[i], 1, 1e-2) << seed;
  }
}

// x1 + x2 = 0 is held by y. x3 feeds x1, but stays zero.
TEST(SmoothStepTest, WhatNothingReachesIsZeroWithoutError) {
  Problem problem = SmoothProblem(Matrix{{-1.5, 0, 7}, {0, -0.5, 0}, {0, 0, -1e6}}, Vector{{1, -1, 0}}, {}, 2);
  problem.B = Vector{{1, 1, 0}};
  problem.N = Vector{{1, 1, 0}}.transpose();
  problem.M = Matrix{{0}};
  problem.g = TimeFunction::Zero(1);
  const SmoothRun run(problem, {0}, 2);
  ASSERT_EQ(run.step.unreached, (std::vector<Index>{2}));
  EXPECT_TRUE(run.step.x.row(2).isZero(0));
  EXPECT_EQ(run.step.x_error.truncation[2], 0);
  EXPECT_EQ(run.step.x_tail[2], 0);
  EXPECT_EQ(run.step.layer[2], 0);
  problem.x0[2] = 1e-9;
  EXPECT_TRUE(SmoothRun(problem, {0}, 2).step.unreached.empty());
}

// The error of a guard, or y, and what the step says of it.
void ExpectGuardOf(const SmoothRun& run, double length, const std::function<double(double)>& exact) {
  const double error = ErrorsInside(run.step.guard.values, length, [&](double t) { return Vector{{exact(t)}}; })[0];
  EXPECT_LE(error, 3 * run.step.guard.error.truncation[0] + run.step.guard.error.rounding[0]);
  EXPECT_LE(run.step.guard.error.truncation[0], 1e3 * error + run.step.guard.error.rounding[0]);
  EXPECT_GE(run.step.guard_level[0], run.step.guard.error.rounding[0]);
  EXPECT_GE(run.step.guard_level[0], run.step.guard.tail[0]);
  EXPECT_GE(run.step.guard_level[0], 0.99e-6 * kSmoothTolerance * std::abs(exact(0)));
  EXPECT_GE(run.step.guard.terms[0], std::abs(exact(0)));
}

// x' = -x + y, w = 0.5 x + 3 t + M y = 0 or y = 0: x = e^(-t) while inactive.
TEST(SmoothStepTest, AnInactiveGuardIsItsSlack) {
  for (double z = 0.2; z < 1e4; z *= 1.6) {
    SCOPED_TRACE(z);
    Problem problem = SmoothProblem(Matrix{{-1}}, Vector{{1}}, {}, z);
    problem.B = Matrix{{1}};
    problem.N = Matrix{{0.5}};
    problem.g = TimeFunction::Formulas({"3*t"});
    const SmoothRun run(problem, {}, z);
    EXPECT_TRUE(run.step.y.isZero(0));
    ExpectGuardOf(run, z, [](double t) { return 0.5 * std::exp(-t) + 3 * t; });
  }
}

// x' = -x + y, 0 = x - 10 + 4 y: y = (10 - x)/4, x' = -1.25 x + 2.5.
TEST(SmoothStepTest, AnActiveGuardIsItsMultiplier) {
  for (double z = 0.2; z < 1e4; z *= 1.6) {
    SCOPED_TRACE(z);
    Problem problem = SmoothProblem(Matrix{{-1}}, Vector{{5}}, {}, z);
    problem.B = Matrix{{1}};
    problem.N = Matrix{{1}};
    problem.M = Matrix{{4}};
    problem.g = TimeFunction::Constant(Vector{{-10}});
    const SmoothRun run(problem, {0}, z);
    const auto x = [](double t) { return 2 + 3 * std::exp(-1.25 * t); };
    ExpectEstimatesOf(run, ErrorsInside(run.step.x, z, [&](double t) { return Vector{{x(t)}}; }));
    ExpectGuardOf(run, z, [&](double t) { return (10 - x(t)) / 4; });
    EXPECT_EQ(run.step.y, run.step.guard.values);
  }
}

// x1' = -a x1 + y, x2' = -b x2 + y, x1 + x2 = 0: x1 = e^(-(a + b) t/2), y = (a - b)/2 x1.
TEST(SmoothStepTest, AMultiplierThatHoldsAConstraintIsASlope) {
  constexpr double kA = 1.5, kB = 0.5;
  for (double z = 0.2; z < 30; z *= 1.6) {
    SCOPED_TRACE(z);
    Problem problem = SmoothProblem(Matrix{{-kA, 0}, {0, -kB}}, Vector{{1, -1}}, {}, z);
    problem.B = Matrix{{1}, {1}};
    problem.M = Matrix{{0}};
    problem.g = TimeFunction::Zero(1);
    const SmoothRun run(problem, {0}, z);
    const Vector errors = ErrorsInside(run.step.x, z, [](double t) { return Vector{{std::exp(-t), -std::exp(-t)}}; });
    ExpectEstimatesOf(run, errors);
    ExpectGuardOf(run, z, [](double t) { return std::exp(-t) / 2; });
  }
}

// x1 + x2 = 0 by a pair that moves x1, and x2 follows x3 = exp(-t) at the rate 1e8. So y = -x2', which is exp(-t), and
// larger by rate times what x2 starts above that.
TEST(SmoothStepTest, ALayerLiftsAMultiplierByItsSlope) {
  constexpr double kRate = 1e8, kOff = 1e-9;
  constexpr double kStart = kRate / (kRate - 1) + kOff;
  Problem problem =
      SmoothProblem(Matrix{{0, 0, 0}, {0, -kRate, kRate}, {0, 0, -1}}, Vector{{-kStart, kStart, 1}}, {}, 1);
  problem.B = Matrix{{1}, {0}, {0}};
  problem.N = Matrix{{1, 1, 0}};
  problem.M = Matrix{{0}};
  problem.g = TimeFunction::Zero(1);
  problem.outputs.names = {"3 y", "x2"};
  problem.outputs.C = Matrix{{0, 0, 0}, {0, 1, 0}};
  problem.outputs.D = Matrix{{3}, {0}};
  problem.outputs.h = TimeFunction::Zero(2);
  const SmoothRun run(problem, {0}, 1);
  EXPECT_NEAR(run.step.guard.error.truncation[0], kRate * kOff, 0.01 * kRate * kOff);
  EXPECT_NEAR(run.step.outputs.error.truncation[0], 3 * kRate * kOff, 0.03 * kRate * kOff);
  EXPECT_NEAR(run.step.outputs.error.truncation[1], 2 * kOff, 1.2 * kOff);
  ASSERT_NEAR(run.step.layer_length * kRate, 8, 1e-6);
  const SmoothRun resolved(problem, {0}, run.step.layer_length);
  EXPECT_LE(resolved.step.error_ratio, 1);
  EXPECT_NEAR(ValueOf(resolved.step.guard.values, LegendreValues(-1))[0], 1 + kRate * kOff, 1e-6);
  // What x is off by when the step starts is no layer of the solution.
  Magnitudes known = run.magnitudes;
  known.errors = Vector{{-kOff, kOff, 0}};
  const SmoothStep step =
      TakeSmoothStep(run.step.stepper, problem.x0, run.sources, known, kSmoothTolerance, 1, nullptr);
  EXPECT_LE(step.guard.error.truncation[0], 1e-3 * kRate * kOff);
  EXPECT_LE(step.error_ratio, 1);
}

// A pair holds the first state on a line through others, where x' of 16 is what is left of terms of 1e11. The
// triangular form of the mode has lost four digits of that to its scaling, and its slopes with them.
TEST(SmoothStepTest, SlopesSatisfyTheEquationsOfTheMode) {
  Problem problem;
  problem.A = Matrix{{-314804087508.1086, 313869877638.4767, 0, 841517535.0684836},
                     {25.599447907707727, -38.82470347121357, 13.103718911272956, 0},
                     {0, 2.306019195662767, -2.3601501740137243, 0},
                     {0.009771822504686395, 0, 0, -0.5248423206768994}};
  problem.B = Matrix{{-39289976928.06592, 0},
                     {6.409036287474327, 0},
                     {-1.6918129278437752, -1.6918129278437752},
                     {0, 0.9124817125124761}};
  problem.N = Matrix{{-0.5, 1, -1.5, 0}, {0, 0, -1.5, 1}};
  problem.M = Matrix{{0, 1.5}, {-1.5, 0}};
  problem.f = TimeFunction::Constant(Vector{{0.342, 3.24, -0.219, 0.45}});
  problem.g = TimeFunction::Constant(Vector{{0.8376, -0.155}});
  problem.x0 = Vector{{0.454, 0.45295, 0.70909, 1.2511}};
  problem.x0[0] = 2 * (problem.x0[1] - 1.5 * problem.x0[2] + 0.8376);
  problem.horizon = 2.459;
  const SmoothRun run(problem, {0}, 1e-3);
  const Eigen::RowVectorXd N = problem.N.Dense().row(0);
  for (const double s : {-0.5, 0.0, 0.5}) {
    const Vector x = ValueOf(run.step.x, LegendreValues(s));
    const double y = -N.dot(problem.A.Dense() * x + ValueOf(run.sources.f.values, LegendreValues(s))) /
                     N.dot(problem.B.Dense().col(0));
    EXPECT_NEAR(ValueOf(run.step.guard.values, LegendreValues(s))[0], y, 1e-13) << "at " << s;
  }
}

TEST(SmoothStepTest, AGapRaisesTheLevelsByWhatItMakesOfTheGuards) {
  const SmoothRun run(SmoothProblem(-Matrix::Identity(2, 2), Vector{{1, 2}}, {}, 1), {}, 1);
  const EventGap gap{Vector{{1e-3, 2e-3}}, Vector::Zero(2), Vector{{5e-3}}};
  const SmoothStep with_gap =
      TakeSmoothStep(run.step.stepper, run.problem.x0, run.sources, run.magnitudes, kSmoothTolerance, 1, &gap);
  EXPECT_NEAR(with_gap.guard_level[0] - run.step.guard_level[0], 8e-3, 1e-12);
  // That of a step is what vanishes at its end, and events are inside.
  const SmoothRun longer = SmoothDecay(6);
  EXPECT_EQ(GapOf(longer.step, longer.sources).x, longer.step.x_tail);
  EXPECT_LE(MaxAbs(GapOf(longer.step, longer.sources).f), 1e-12);
}

TEST(SmoothStepTest, AnEarlyEndHasTheSizesUpToThere) {
  constexpr double kLength = 6;
  SmoothRun run = SmoothGrowth(kLength);
  const auto ratio = [&](double s) {
    return ErrorRatioBefore(s, *run.mode, run.step, run.magnitudes, kSmoothTolerance, 1);
  };
  EXPECT_GT(run.step.error_ratio, 1e-3);
  EXPECT_NEAR(ratio(1) / run.step.error_ratio, 1, 1e-3);
  for (const double s : {-0.9, -0.2, 0.5}) {
    EXPECT_NEAR(ratio(s) / run.step.error_ratio, std::exp(kLength * (1 - s) / 2), 2) << s;
  }
  const SmoothStep whole = run.step;
  LimitSizes(run.sources, 0, run.step);
  EXPECT_NEAR(run.step.x_size[0], std::exp(kLength / 2), 1e-3);
  EXPECT_NEAR(run.step.slope_size[0], std::exp(kLength / 2), 1e-3);
  EXPECT_NEAR(run.step.guard.terms[0], 1000 + std::exp(kLength / 2), 1e-3);
  EXPECT_NEAR(run.step.row_error.rounding[0] / whole.row_error.rounding[0], std::exp(-kLength / 2), 1e-3);
  LimitSizes(run.sources, 1, run.step);  // limits are never raised
  EXPECT_NEAR(run.step.x_size[0], std::exp(kLength / 2), 1e-3);
}

TEST(SmoothStepTest, LooksAreSpreadFromTheBeginToTheEnd) {
  const auto at = LooksBefore(0.6);
  EXPECT_LT(MaxAbs(at.col(0) - LegendreValues(-1)), 1e-14);
  EXPECT_LT(MaxAbs(at.col(2) - LegendreValues(-0.2)), 1e-14);
  EXPECT_LT(MaxAbs(at.col(4) - LegendreValues(0.6)), 1e-14);
}

TEST(SmoothStepTest, SlopesAreThoseOfTheSolution) {
  const SmoothRun run = SmoothDecay(1);
  for (const double s : {-1.0, -0.4, 0.0, 0.7, 1.0}) {
    EXPECT_NEAR(SlopeAt(run.step, run.sources, s)[0], -std::exp(-(1 + s) / 2), 1e-11) << s;
  }
}

TEST(SmoothStepTest, TruncationWithSignsCountsOnlyWhereItIsRounding) {
  const SignedErrorBounds bounds{{Vector{{3, 3, 3, 1e-9}}, Vector::Constant(4, 1e-7)},
                                 Vector{{-1e-9, 1e-3, -2, -1e-8}}};
  EXPECT_EQ(bounds.Truncation(), (Vector{{1e-9, 3, 3, 1e-9}}));
}

// The constraint 2 x1 + x2 + g = 0 with g = -5, held by y along B = (1, 3).
class ProjectTest : public ::testing::Test {
 protected:
  ProjectTest() {
    problem_ = SmoothProblem(-Matrix::Identity(2, 2), Vector{{1, 3}}, {}, 1);
    problem_.B = Vector{{1, 3}};
    problem_.N = Vector{{2, 1}}.transpose();
    problem_.M = Matrix{{0}};
    problem_.g = TimeFunction::Constant(Vector{{-5}});
    run_ = std::make_unique<SmoothRun>(problem_, std::vector<Index>{0}, 0.5);
  }
  bool Projects(Vector& x) { return Project(*run_->mode, run_->sources, kSmoothTolerance, run_->magnitudes, x); }

  Problem problem_;
  std::unique_ptr<SmoothRun> run_;
};

TEST_F(ProjectTest, MovesTheStateAlongBOntoTheConstraint) {
  Vector x{{1 + 1e-7, 3 - 5e-7}};
  const Vector before = x;
  ASSERT_TRUE(Projects(x));
  EXPECT_NEAR(2 * x[0] + x[1], 5, 1e-14);
  const Vector change = x - before;
  EXPECT_GT(MaxAbs(change), 1e-8);
  EXPECT_NEAR(change[1], 3 * change[0], 1e-14);
}

TEST_F(ProjectTest, LeavesWhatIsOnTheConstraintOrTooFarOff) {
  Vector x{{1, 3}};
  EXPECT_TRUE(Projects(x));
  EXPECT_EQ(x, (Vector{{1, 3}}));
  x = Vector{{1.01, 3}};
  EXPECT_FALSE(Projects(x));
  EXPECT_EQ(x, (Vector{{1.01, 3}}));
  // Without constraints there is nothing to move.
  const SmoothRun run = SmoothDecay(1);
  Magnitudes magnitudes = run.magnitudes;
  Vector free{{17}};
  EXPECT_TRUE(Project(*run.mode, run.sources, kSmoothTolerance, magnitudes, free));
  EXPECT_EQ(free[0], 17);
}

// x2 is zero so far, and moves by three times what rounding has of x1.
TEST_F(ProjectTest, MovesAStateThatIsZeroByTheRoundingOfOthers) {
  problem_.g = TimeFunction::Constant(Vector{{-2}});
  SmoothRun run(problem_, std::vector<Index>{0}, 0.5);
  Magnitudes& magnitudes = run.magnitudes;
  magnitudes.x = Vector{{1, 0}};
  magnitudes.rounding.bound = Vector{{1e-12, 0}};
  Vector x{{1 + 4e-13, 0}};
  ASSERT_TRUE(Project(*run.mode, run.sources, kSmoothTolerance, magnitudes, x));
  EXPECT_NEAR(x[1], 3 * (x[0] - 1 - 4e-13), 1e-15);
  EXPECT_NEAR(2 * x[0] + x[1], 2, 1e-15);
  // That rounding does not explain more.
  magnitudes.rounding.bound = Vector{{1e-14, 0}};
  x = Vector{{1 + 4e-13, 0}};
  EXPECT_FALSE(Project(*run.mode, run.sources, kSmoothTolerance, magnitudes, x));
}

}  // namespace
}  // namespace dlcs
