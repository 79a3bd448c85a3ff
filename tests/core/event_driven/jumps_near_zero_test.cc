// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/jumps_near_zero.h"

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
    OverlookedByCause overlooked{none, none, none, none.y};
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

}  // namespace
}  // namespace dlcs
