// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/problem/formula.h"

namespace dlcs {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;

GateWave TimesOf(const std::vector<ControlTerm>& control, const SwitchModel& model, double horizon) {
  const auto gate = GateOf(control, model, horizon);
  EXPECT_TRUE(gate.ok()) << gate.status();
  if (!gate.ok() || !std::holds_alternative<GateWave>(*gate)) return {};
  return std::get<GateWave>(*gate);
}

TEST(GateTest, APulseGivesAPulseWithHysteresis) {
  const PulseWave drive{.low = 0, .high = 5, .delay = 1, .rise = 1, .fall = 1, .width = 2, .period = 10};
  const auto gate = GateOf({{1, drive}}, {.threshold = 2.5, .hysteresis = 0.5}, 100);
  ASSERT_TRUE(gate.ok());
  const auto& pulse = std::get<PulseWave>(*gate);
  EXPECT_DOUBLE_EQ(pulse.delay, 1.6);        // 3 V on the way up
  EXPECT_DOUBLE_EQ(pulse.width, 3.6 - 0.6);  // 2 V on the way down: 1 + 2 + 0.6
  EXPECT_EQ(pulse.period, 10);
}

TEST(GateTest, OpensAtTheEndOfThePeriodThatCutsThePulse) {
  const PulseWave drive{.low = 0, .high = 4, .rise = 1, .fall = 1, .width = 1, .period = 2.25};
  const auto gate = GateOf({{1, drive}}, {.threshold = 2}, 100);
  ASSERT_TRUE(gate.ok());
  EXPECT_EQ(std::get<PulseWave>(*gate).delay, 0.5);
  EXPECT_EQ(std::get<PulseWave>(*gate).width, 1.75);
}

TEST(GateTest, ANegatedPulseOpens) {
  const PulseWave drive{.low = 0, .high = 5, .delay = 1, .rise = 1, .fall = 1, .width = 2, .period = 10};
  const auto gate = GateOf({{-1, drive}, {1, ConstantWave{5}}}, {.threshold = 2.5}, 100);
  ASSERT_TRUE(gate.ok());
  const auto& pulse = std::get<PulseWave>(*gate);
  EXPECT_EQ(pulse.low, 1);
  EXPECT_EQ(pulse.high, 0);
  EXPECT_DOUBLE_EQ(pulse.delay, 1.5);
  EXPECT_DOUBLE_EQ(pulse.width, 3);
}

TEST(GateTest, ASineCrossesTwoLevels) {
  const GateWave gate =
      TimesOf({{2, SineWave{.amplitude = 1, .frequency = 1}}}, {.threshold = 0.5, .hysteresis = 0.5}, 2);
  const double up = std::asin(0.5) / (2 * std::numbers::pi);  // 2 sin = 1
  EXPECT_FALSE(gate.starts_closed);
  EXPECT_THAT(gate.times, ElementsAre(DoubleNear(up, 1e-15), DoubleNear(0.5, 1e-15), DoubleNear(1 + up, 1e-15),
                                      DoubleNear(1.5, 1e-15)));
}

TEST(GateTest, ACarrierIsComparedExactly) {
  // 0.5 + 0.4 sin(2πt) above a triangle between 0 and 1 of period 0.1: the crossings solve both.
  const PulseWave carrier{.low = 0, .high = 1, .rise = 0.05, .fall = 0.05, .width = 0, .period = 0.1};
  const SineWave wanted{.offset = 0.5, .amplitude = 0.4, .frequency = 1};
  const GateWave gate = TimesOf({{1, wanted}, {-1, carrier}}, {}, 1);
  ASSERT_EQ(gate.times.size(), 20);
  EXPECT_TRUE(gate.starts_closed);
  for (const double t : gate.times) {
    const double phase = t / 0.1 - std::floor(t / 0.1);
    EXPECT_NEAR(0.5 + 0.4 * std::sin(2 * std::numbers::pi * t), 1 - std::abs(1 - 2 * phase), 1e-13);
  }
}

TEST(GateTest, ALineThatTouchesOnlyOneLevelStays) {
  const PiecewiseLinearWave line{.times = {0, 1, 2, 3}, .values = {0, 2.8, 2.2, 3.4}};
  const GateWave gate = TimesOf({{1, line}}, {.threshold = 2.5, .hysteresis = 0.5}, 4);
  EXPECT_THAT(gate.times, ElementsAre(DoubleNear(2 + 0.8 / 1.2, 1e-14)));
}

TEST(GateTest, AConstantDecidesAtOnce) {
  const auto gate = [](double value, bool closed) {
    return std::get<ConstantWave>(
               *GateOf({{1, ConstantWave{value}}}, {.threshold = 1, .hysteresis = 0.5, .starts_closed = closed}, 1))
        .value;
  };
  EXPECT_EQ(gate(2, false), 1);
  EXPECT_EQ(gate(0, true), 0);
  EXPECT_EQ(gate(1, false), 0);
  EXPECT_EQ(gate(1, true), 1);
}

}  // namespace
}  // namespace dlcs
