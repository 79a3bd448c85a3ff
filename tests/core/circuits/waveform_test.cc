// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/waveform.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/problem/formula.h"

namespace dlcs {
namespace {

double At(const std::string& formula, double t) {
  auto parsed = Formula::Parse(formula);
  EXPECT_TRUE(parsed.ok()) << formula << ": " << parsed.status();
  return parsed.ok() ? parsed->Evaluate(t) : 0;
}

double ValueAt(const Waveform& wave, double t) { return At(FormulaNear(wave, t), t); }

TEST(WaveformTest, APulseHasRampsPeriodsAndDelay) {
  const PulseWave pulse{.low = -1, .high = 3, .delay = 2, .rise = 0.5, .fall = 1, .width = 1.5, .period = 5};
  for (const double start : {2.0, 7.0, 52.0}) {
    EXPECT_NEAR(ValueAt(pulse, start - 1e-9), -1, 1e-7);
    EXPECT_NEAR(ValueAt(pulse, start + 0.25), 1, 1e-12);
    EXPECT_NEAR(ValueAt(pulse, start + 1), 3, 1e-12);
    EXPECT_NEAR(ValueAt(pulse, start + 2.5), 1, 1e-12);
    EXPECT_NEAR(ValueAt(pulse, start + 4), -1, 1e-12);
  }
  EXPECT_EQ(ValueAt(pulse, 0), -1);
  EXPECT_EQ(StartValue(pulse), -1);
  EXPECT_FALSE(HasJump(pulse, 100));
  PulseWave edges = pulse;
  edges.rise = edges.fall = 0;
  EXPECT_TRUE(HasJump(edges, 100));
  EXPECT_EQ(ValueAt(edges, 2.1), 3);
  EXPECT_EQ(ValueAt(edges, 3.6), -1);
}

TEST(WaveformTest, APeriodCutsAPulseThatIsLonger) {
  const PulseWave pulse{.low = 0, .high = 4, .rise = 1, .fall = 1, .width = 1, .period = 2.5};
  EXPECT_EQ(ValueAt(pulse, 2.25), 3);
  EXPECT_EQ(ValueAt(pulse, 2.75), 1);
  EXPECT_TRUE(HasJump(pulse, 10));
}

TEST(WaveformTest, SinesStartLateAndDecay) {
  const SineWave sine{.offset = 1, .amplitude = 2, .frequency = 0.5, .delay = 1, .damping = 0.1, .phase = 30};
  EXPECT_NEAR(ValueAt(sine, 0.3), 1 + 2 * 0.5, 1e-15);
  EXPECT_NEAR(ValueAt(sine, 3), 1 + 2 * std::exp(-0.2) * std::sin(std::numbers::pi * 2 + std::numbers::pi / 6), 1e-14);
  EXPECT_NEAR(StartValue(sine), 2, 1e-15);
  // From before 0 on: a third of a period ahead.
  const SineWave ahead{.offset = 1, .amplitude = 2, .frequency = 0.5, .delay = -2.0 / 3, .damping = 0.1};
  EXPECT_NEAR(StartValue(ahead), 1 + 2 * std::exp(-0.2 / 3) * std::sin(std::numbers::pi * 2 / 3), 1e-15);
  EXPECT_NEAR(ValueAt(ahead, 0), StartValue(ahead), 1e-14);
  EXPECT_NEAR(ValueAt(ahead, 1), 1 + 2 * std::exp(-0.5 / 3) * std::sin(std::numbers::pi * 5 / 3), 1e-14);
  EXPECT_EQ(FaultOf(ahead), "");
}

TEST(WaveformTest, SinesEndAfterTheirCycles) {
  const SineWave sine{.offset = 1, .amplitude = 2, .frequency = 0.5, .delay = 1, .phase = 30, .cycles = 1.25};
  EXPECT_THAT(Cuts(sine, 10), ::testing::ElementsAre(3.5));
  EXPECT_TRUE(Cuts(sine, 3).empty());
  EXPECT_NEAR(ValueAt(sine, 3), 1 + 2 * std::sin(std::numbers::pi * 2 + std::numbers::pi / 6), 1e-14);
  EXPECT_NEAR(ValueAt(sine, 3.6), 2, 1e-14);  // what it was before its delay
  EXPECT_NEAR(ValueAt(sine, 3.6), ValueAt(sine, 0.5), 1e-14);
  EXPECT_TRUE(HasJump(sine, 10));
  EXPECT_FALSE(HasJump(sine, 3));
  EXPECT_FALSE(HasJump(SineWave{.amplitude = 2, .frequency = 0.3, .delay = 1, .phase = 180, .cycles = 3}, 100));
  EXPECT_THAT(FaultOf(SineWave{.amplitude = 1, .frequency = 1, .cycles = -1}), ::testing::HasSubstr("cycles"));
}

TEST(WaveformTest, AmplitudesAreModulated) {
  const AmplitudeModulatedWave wave{.offset = 0.5, .mean = 2, .depth = -1, .signal = 0.1, .carrier = 3, .delay = 1};
  EXPECT_EQ(ValueAt(wave, 0.9), 0);
  EXPECT_EQ(StartValue(wave), 0);
  EXPECT_NEAR(ValueAt(wave, 3.3),
              0.5 + (2 - std::sin(0.2 * std::numbers::pi * 2.3)) * std::sin(6 * std::numbers::pi * 2.3), 1e-13);
  EXPECT_TRUE(HasJump(wave, 2));
  EXPECT_FALSE(HasJump(wave, 0.5));
  EXPECT_EQ(Peak(wave), 3.5);
  EXPECT_NE(FaultOf(AmplitudeModulatedWave{.delay = -1}), "");
}

TEST(WaveformTest, LinesAreCutAtTheirPoints) {
  const PiecewiseLinearWave line{.times = {1, 2, 2, 4}, .values = {5, 7, 0, -2}};
  EXPECT_THAT(Cuts(line, 4), ::testing::ElementsAre(1, 2));
  EXPECT_EQ(ValueAt(line, 0.5), 5);
  EXPECT_EQ(ValueAt(line, 1.5), 6);
  EXPECT_EQ(ValueAt(line, 3), -1);
  EXPECT_EQ(ValueAt(line, 5), -2);
  EXPECT_TRUE(HasJump(line, 4));
  EXPECT_FALSE(HasJump(line, 2));
}

TEST(WaveformTest, PulsesEndAfterTheirNumber) {
  const PulseWave pulse{
      .low = 1, .high = 3, .delay = 0.5, .rise = 0.1, .fall = 0.1, .width = 0.2, .period = 1, .cycles = 2};
  EXPECT_EQ(ValueAt(pulse, 0.7), 3);
  EXPECT_EQ(ValueAt(pulse, 1.7), 3);
  EXPECT_EQ(ValueAt(pulse, 2.7), 1);
  EXPECT_EQ(ValueAt(pulse, 9.7), 1);
  EXPECT_THAT(FaultOf(PulseWave{.high = 1, .period = 1, .cycles = 1.5}), ::testing::HasSubstr("whole number"));
}

TEST(WaveformTest, LinesRepeatFromATimeOn) {
  const PiecewiseLinearWave whole{.times = {0, 1, 3, 4}, .values = {0, 5, 5, 1}, .repeats_from = 0};
  EXPECT_TRUE(Cuts(whole, 100).empty());
  EXPECT_TRUE(HasJump(whole, 10));  // from 1 to 0
  EXPECT_FALSE(HasJump(whole, 3.5));
  for (const double start : {0.0, 4.0, 40.0}) {
    EXPECT_NEAR(ValueAt(whole, start + 0.5), 2.5, 1e-12);
    EXPECT_NEAR(ValueAt(whole, start + 2), 5, 1e-12);
    EXPECT_NEAR(ValueAt(whole, start + 3.5), 3, 1e-12);
  }
  // The first second is gone through once.
  const PiecewiseLinearWave tail{.times = {0, 1, 2, 2, 3}, .values = {8, 0, 4, 2, 0}, .repeats_from = 1};
  EXPECT_NEAR(ValueAt(tail, 0.5), 4, 1e-12);
  for (const double start : {1.0, 3.0, 21.0}) {
    EXPECT_NEAR(ValueAt(tail, start + 0.5), 2, 1e-12);
    EXPECT_NEAR(ValueAt(tail, start + 1.5), 1, 1e-12);
  }
  EXPECT_THAT(FaultOf(PiecewiseLinearWave{.times = {0, 1}, .values = {0, 1}, .repeats_from = 1}),
              ::testing::HasSubstr("before its last time, 1"));
}

TEST(WaveformTest, AFormulaStartsAtItsLimitFromTheRight) {
  EXPECT_EQ(StartValue(FormulaWave{"3*(t > 0) + cos(t)", 4}), 4);
  EXPECT_EQ(StartValue(FormulaWave{"t*1e5", 4}), 0);
  EXPECT_NE(FaultOf(FormulaWave{"1/t", 1}), "");
  EXPECT_FALSE(HasDerivative(FormulaWave{"t", 1}));
}

TEST(WaveformTest, LinesThroughPointsOfAFormula) {
  const std::string text = LinesText({-1, 0, 0, 2}, {5, 6, 7, 3}, "(2*t)");
  for (const auto& [t, value] : {std::pair(-2.0, 0.0), {-0.25, 0.5}, {0.25, 1.0}, {1.0, -2.0}, {7.0, -2.0}}) {
    EXPECT_NEAR(At(text, t), value, 1e-12) << text << " at " << t;
  }
}

TEST(WaveformTest, DerivativesAreThoseOfTheFormulas) {
  const std::vector<Waveform> waves = {
      PulseWave{.low = -1, .high = 3, .delay = 0.1, .rise = 0.5, .fall = 1, .width = 1.5, .period = 5},
      SineWave{.offset = 1, .amplitude = 2, .frequency = 0.5, .delay = 0.2, .damping = 0.1, .phase = 30},
      PulseWave{.high = 3, .delay = 0.1, .rise = 0.5, .fall = 1, .width = 0.5, .period = 2.1, .cycles = 2},
      PiecewiseLinearWave{.times = {1, 2, 4}, .values = {5, 7, -2}},
      PiecewiseLinearWave{.times = {0, 0.5, 1.1, 1.9}, .values = {2, 5, 7, -2}, .repeats_from = 0.5},
      ExponentialWave{.first = 1, .second = 4, .rise_delay = 0.3, .rise = 0.7, .fall_delay = 2, .fall = 1.2},
      FrequencyModulatedWave{.offset = 1, .amplitude = 2, .carrier = 1.1, .index = 0.4, .signal = 0.3},
      SineWave{.offset = 1, .amplitude = 2, .frequency = 0.5, .delay = 0.2, .damping = 0.1, .cycles = 2.1},
      AmplitudeModulatedWave{.offset = 1, .mean = -2, .depth = 3, .signal = 0.3, .carrier = 1.1, .delay = 0.6}};
  for (const Waveform& wave : waves) {
    for (double t = 0.043; t < 6; t += 0.37) {
      const double h = 1e-6;
      EXPECT_NEAR(At(DerivativeNear(wave, t), t), (ValueAt(wave, t + h) - ValueAt(wave, t - h)) / (2 * h), 1e-7)
          << FormulaNear(wave, t) << " at " << t;
    }
  }
}

TEST(WaveformTest, NamesWhatIsWrong) {
  EXPECT_THAT(FaultOf(PulseWave{.high = 1, .rise = -1}), ::testing::HasSubstr("at least 0"));
  EXPECT_THAT(FaultOf(PiecewiseLinearWave{.times = {1, 0}, .values = {1, 1}}), ::testing::HasSubstr("must increase"));
  EXPECT_THAT(FaultOf(ExponentialWave{.rise = 0}), ::testing::HasSubstr("TAU1"));
  EXPECT_EQ(FaultOf(SineWave{.amplitude = 1, .frequency = 50}), "");
}

}  // namespace
}  // namespace dlcs
