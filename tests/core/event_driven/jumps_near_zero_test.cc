// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/jumps_near_zero.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "core/event_driven/mode.h"
#include "core/format_number.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::SolveAt;

// A relay that measures x1 and drives x2 by y1, which jumps to 1 where x1 falls through zero: 0 <= y1 ⟂ x1 + y2 >= 0,
// 0 <= y2 ⟂ 1 - y1 >= 0.
class JumpsNearZeroTest : public ::testing::Test {
 protected:
  JumpsNearZeroTest() {
    problem_.A = Matrix::Zero(2, 2);
    problem_.B = Matrix{{0, 0}, {-7, 0}};
    problem_.N = Matrix{{1, 0}, {0, 0}};
    problem_.M = Matrix{{0, 1}, {-1, 0}};
    problem_.horizon = 1;
    mode_ = ModeMaker(problem_).Make({}, {Vector::Ones(2), Vector::Ones(2), Vector::Ones(2)});
    stepper_ = std::make_shared<const ModeStepper>(*mode_, 0.1);
  }
  // What x1 = 0.1 (1 + s), known to 0.05, adds. It is that near for a quarter of the step.
  OverlookedByCause Of(bool y_is_lipschitz, bool begins_mode, double rounding = 0) {
    SmoothStep step;
    step.stepper = stepper_;
    step.x = step.guard.values = LegendreSeries::Zero(2, kLegendreSize);
    step.x(0, 0) = step.x(0, 1) = step.guard.values(0, 0) = step.guard.values(0, 1) = 0.1;
    step.guard.values(1, 0) = 1;
    step.guard.error.truncation = step.guard.error.rounding = Vector::Zero(2);
    step.y = LegendreSeries::Zero(2, kLegendreSize);
    step.x_error.truncation = step.x_error.rounding = Vector::Zero(2);
    if (rounding > 0) step.guard.error.rounding[0] = 1e-12;
    const Overlooked none{Vector::Zero(2), Vector::Zero(2), Vector::Zero(2), Vector::Zero(2)};
    OverlookedByCause overlooked{none, none, none, none.y, none.y};
    JumpsNearZero jumps(problem_, Selection::kAny, y_is_lipschitz);
    const Vector truncation{{0.05 - rounding, 0}};
    problem_.f = problem_.g = TimeFunction::Constant(Vector{{2, 0}});
    Sources known = *Sources::Create(problem_);
    SourceSampler sampler(known);
    StepSources sources;
    sources.length = 0.1;
    sources.f.values = LegendreSeries::Zero(2, kLegendreSize);
    sources.f.values(0, 0) = 2;
    sources.g.is_steady = true;
    jumps.AddTo(step, {truncation, Vector{{rounding, 0}}}, Vector::Zero(2), 1, begins_mode, std::nullopt, sampler,
                sources, overlooked);
    return overlooked;
  }

  Problem problem_;
  std::unique_ptr<Mode> mode_;
  std::shared_ptr<const ModeStepper> stepper_;
};

TEST_F(JumpsNearZeroTest, AnErrorThatReachesZeroMayHaveSwitchedTheRelay) {
  const OverlookedByCause found = Of(false, false);
  EXPECT_EQ(found.truncation.slope[0], 0);
  EXPECT_NEAR(found.truncation.slope[1], 7 * 0.25, 0.4);
  EXPECT_NEAR(found.with_signs.slope[1], -7 * 0.25, 0.4);
  EXPECT_TRUE(found.rounding.slope.isZero(0));
  EXPECT_NEAR(found.truncation.y[0], 0.25 * 0.1, 0.006);  // 1, for a quarter of a tenth of the horizon
  EXPECT_TRUE(found.rounding.y.isZero(0));
}

TEST_F(JumpsNearZeroTest, RoundingIsCountedAsRounding) {
  const OverlookedByCause found = Of(false, false, 0.05);
  EXPECT_NEAR(found.rounding.slope[1], 7 * 0.25, 0.4);
  EXPECT_TRUE(found.truncation.slope.isZero(0));
}

TEST_F(JumpsNearZeroTest, NothingJumpsBesideAnEventNorWhereYIsLipschitz) {
  EXPECT_LT(Of(false, true).truncation.slope[1], 0.35);  // to a fifth
  EXPECT_TRUE(Of(true, false).truncation.slope.isZero(0));
}

// w = x + g = sin(5t)/1000 falls to zero at π/5. There a contact holds it, y = -cos(5t)/200 (M = 0), or a relay turns
// on, y1 = 1. Beside an x of 1e10 and more, rounding hides that: a few steps see no event, and which y holds is not
// known.
TEST(HiddenJumpsTest, CountAsErrorsOfY) {
  constexpr double kAt = 0.8;
  for (const double large : {1e2, 1e4, 1e6, 1e8, 1e10, 1e12, 1e14}) {
    Problem contact, relay;
    contact.A = Matrix{{0.0}};
    contact.B = Matrix{{1.0}};
    contact.N = Matrix{{1.0}};
    contact.M = Matrix{{0.0}};
    contact.x0 = Vector{{large}};
    contact.f = TimeFunction::Constant(Vector{{0.0}});
    contact.horizon = 1;
    const std::string hidden = "-" + FormatNumber(large) + "+0.001*sin(5*t)";
    contact.g = TimeFunction::Formulas({hidden});
    relay = contact;
    relay.B = Matrix{{0.0, 0.0}};
    relay.N = Matrix{{1.0}, {0.0}};
    relay.M = Matrix{{0.0, 1.0}, {-1.0, 0.0}};
    relay.g = TimeFunction::Formulas({hidden, "1"});
    for (const auto& [problem, y] : {std::pair(contact, -std::cos(5 * kAt) / 200), std::pair(relay, 1.0)}) {
      for (const double tolerance : {1e-4, 1e-6, 1e-9}) {
        const Solution solution = SolveAt(problem, tolerance, {0, kAt, 1});
        const std::string where = FormatNumber(large) + (y == 1 ? " relay " : " contact ") + FormatNumber(tolerance);
        const auto found = solution.y(0, Index{1});
        const bool is_solved = JudgeSolution(solution).kind == VerdictKind::kSolved;
        if (is_solved) {
          EXPECT_LE(std::abs(found - y), tolerance * y) << where;
        }
        if (large <= 1e6 && tolerance >= 1e-6) {
          EXPECT_TRUE(is_solved) << where << ": " << JudgeSolution(solution).text;
        }
        for (const SwitchingTime& at : solution.switching_times) {
          if (at.time < 0.5 || at.time > 0.7) continue;
          EXPECT_LE(std::abs(at.time - std::numbers::pi / 5), std::max(at.error, 1e-15)) << where;
        }
      }
    }
  }
}

// Behind `begin`, w would fall for the time `duration`, and y keeps it from that: by a force (M = 0) or by itself
// (M = 1). Another state is moved by B y with ∫ B y = 1. Where the fall is short, w is no more than the rounding that
// its values have on a step.
TEST(HiddenJumpsTest, MoveTheStatesBesideThem) {
  for (const bool has_force : {true, false}) {
    for (const double begin : {0.0, 0.5}) {
      for (const int power : {1, 3, 5}) {
        for (const double size : {0.1, 1e-2, 1e-3, 1e-5}) {
          const double n = power, duration = has_force ? size / (n + 2) : size;
          const std::string t = "max(0,t-" + FormatNumber(begin) + ")^", a = FormatNumber(size) + "*";
          Problem problem;
          problem.horizon = 1;
          if (has_force) {
            const double integral = size * std::pow(duration, n + 1) / (n + 1) - std::pow(duration, n + 2);
            problem.A = Matrix::Zero(2, 2);
            problem.B = Matrix{{1.0}, {1 / integral}};
            problem.N = Matrix{{1.0, 0.0}};
            problem.M = Matrix{{0.0}};
            problem.x0 = Vector{{0.0, 0.0}};
            problem.f = TimeFunction::Formulas({"-" + a + t + std::to_string(power), "0"});
            problem.g = TimeFunction::Formulas({t + std::to_string(power + 2)});
          } else {
            const double integral = std::pow(size, n + 2) * (1 / (n + 1) - 1 / (n + 2));
            problem.A = Matrix{{0.0}};
            problem.B = Matrix{{1 / integral}};
            problem.N = Matrix{{0.0}};
            problem.M = Matrix{{1.0}};
            problem.x0 = Vector{{0.0}};
            problem.f = TimeFunction::Constant(Vector{{0.0}});
            problem.g = TimeFunction::Formulas({t + std::to_string(power + 1) + "-" + a + t + std::to_string(power)});
          }
          const std::string where = std::string(has_force ? "M = 0" : "M = 1") + ", from " + FormatNumber(begin) +
                                    ", power " + std::to_string(power) + ", " + FormatNumber(size);
          for (const double tolerance : {1e-8, 1e-3}) {
            const Solution solution = SolveAt(problem, tolerance, {0, 1});
            const bool is_solved = JudgeSolution(solution).kind == VerdictKind::kSolved;
            if (is_solved) {
              EXPECT_NEAR(testing::LastState(solution).tail(1)[0], 1, tolerance) << where;
            }
            if (duration > 0.02) {
              EXPECT_TRUE(is_solved) << where << ": " << JudgeSolution(solution).text;
            }
          }
        }
      }
    }
  }
}

// The contact of the test above, for a short time: y = -f until w rises. All that there is of y is hidden by the
// rounding of w, and it is zero to within that, by name.
TEST(HiddenJumpsTest, AForceThatIsHiddenIsZeroByName) {
  for (const double size : {1e-2, 1e-3, 1e-5}) {
    Problem problem = testing::Scalar(0, 1, 0, 1);
    problem.M = Matrix{{0.0}};
    problem.f = TimeFunction::Formulas({"-" + FormatNumber(size) + "*t"});
    problem.g = TimeFunction::Formulas({"t^3"});
    // w' = x' + 3 t^2 < 0 without y, as long as 3 t < size.
    const double time = size / 6, y = size * time - 3 * time * time;
    const Solution solution = SolveAt(problem, 1e-6, {0, time, 1});
    const ErrorsByCause& errors = solution.accuracy.errors.y;
    const Verdict verdict = JudgeSolution(solution);
    if (verdict.kind != VerdictKind::kSolved) continue;
    const auto found = solution.y(0, Index{1});
    EXPECT_LE(std::abs(found - y), std::max(1e-6 * errors.own[0], 2 * errors.rounding[0]))
        << size << ": " << verdict.text;
    if (found == 0) {
      EXPECT_THAT(verdict.text, ::testing::HasSubstr("y[0] is zero")) << size;
    }
  }
}

// A state that a contact could move is zero: w rises from zero, where rounding of its values hides which side it is on.
TEST(HiddenJumpsTest, AStateThatNothingMovesIsZero) {
  for (const double M : {0.0, 1.0}) {
    for (const double A : {-1.0, 0.0}) {
      for (const char* g : {"t^4", "t^2", "t", "max(0,t-0.5)", "max(0,t-0.5)^3", "max(0,t-0.25)*max(0,t-0.5)"}) {
        Problem problem;
        problem.A = Matrix{{A}};
        problem.B = problem.N = Matrix{{1.0}};
        problem.M = Matrix{{M}};
        problem.f = TimeFunction::Constant(Vector{{0.0}});
        problem.g = TimeFunction::Formulas({g});
        problem.x0 = Vector{{0.0}};
        problem.horizon = 1;
        for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
          const Verdict verdict = JudgeSolution(SolveAt(problem, tolerance));
          EXPECT_EQ(verdict.kind, VerdictKind::kSolved) << M << " " << A << " " << g << ": " << verdict.text;
        }
      }
    }
  }
}

}  // namespace
}  // namespace dlcs
