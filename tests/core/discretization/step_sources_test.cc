// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/step_sources.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/discretization/sources.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string WhyNonFinite(const std::string& f) {
  Problem problem = testing::Scalar(-1, 1, 1, 2);
  problem.f = TimeFunction::Formulas({f});
  absl::StatusOr<Sources> sources = Sources::Create(problem);
  if (!sources.ok()) return std::string(sources.status().message());
  SourceSampler sampler(*sources, ResolvedCells(problem));
  StepSources step;
  sampler.Sample(0, 2, step);
  EXPECT_FALSE(step.finite);
  return sampler.WhyNonFinite(step).message;
}

TEST(StepSourcesTest, NamesAValueThatIsNotFinite) {
  EXPECT_THAT(WhyNonFinite("exp(500*t)"), AllOf(StartsWith("f[0] is inf at t = 1."), HasSubstr("must be finite")));
}

TEST(StepSourcesTest, DoesNotCallALargeValueInfinite) {
  EXPECT_THAT(WhyNonFinite("1.7e308*cos(9*t)"),
              AllOf(StartsWith("f[0] is "), HasSubstr("overflow"), Not(HasSubstr("finite"))));
}

// Cells are cut down to the rounding of time beside a jump, so that some of their times are rounded to it.
TEST(StepSourcesTest, TimesThatAreRoundedToTheBeginAreBehindIt) {
  constexpr double kJump = 131072;
  Problem problem = testing::Scalar(-1, 1, 1, kJump + 1);
  problem.f = TimeFunction::Formulas({"(0.5 + 0.5*sign(t - 131072))*(2 + sin(5*(t - 131072)))"});
  absl::StatusOr<Sources> sources = Sources::Create(problem);
  ASSERT_TRUE(sources.ok());
  SourceSampler sampler(*sources, ResolvedCells(problem));
  StepSources step;
  for (const double length : {0.25, 1e-2, 1e-4, 1e-6}) {
    sampler.Sample(kJump, kJump + length, step);
    sampler.Probe(step);
    EXPECT_LE(step.f.error.truncation[0], 1e-9) << length;
  }
}

std::optional<double> KinkOf(const std::string& f) {
  Problem problem = testing::Scalar(-1, 1, 1, 1);
  problem.f = TimeFunction::Formulas({f});
  absl::StatusOr<Sources> sources = Sources::Create(problem);
  if (!sources.ok()) return std::nullopt;
  SourceSampler sampler(*sources);
  StepSources step;
  sampler.Sample(0, 1, step);
  return sampler.FindKink(step);
}

// A thousandth of the source bends, so that halving the step takes away most of what its polynomial misses at first.
TEST(StepSourcesTest, FindsAWeakKinkInASmoothSource) {
  EXPECT_NEAR(KinkOf("1e-3*abs(t - 0.7123) + exp(t)").value_or(NAN), 0.7123, 1e-11);
}

TEST(StepSourcesTest, FindsAJumpOfAThousandUlp) {
  EXPECT_NEAR(KinkOf("2e-13*sign(t - 0.3) + t").value_or(NAN), 0.3, 1e-15);
}

// Of a source that bends in its second derivative only, the polynomials are exact before its place is known.
TEST(StepSourcesTest, AKinkThatIsFoundIsFoundToAMillionthOfTheStep) {
  for (const char* f : {"abs(t - 0.3)*(t - 0.3)", "abs(t - 0.3)^1.5", "abs(t - 0.3)^3", "abs(t - 0.3) + exp(t)"}) {
    EXPECT_NEAR(KinkOf(f).value_or(0.3), 0.3, 1e-6) << f;
  }
}

TEST(StepSourcesTest, AnOscillationAndASteepFrontAreNoKinks) {
  for (const char* f : {"sin(1e5*t)", "sin(1e7*t)", "tanh(1e6*(t - 0.3))"}) EXPECT_FALSE(KinkOf(f)) << f;
}

// Whether f is constant between its break points.
struct SteadyCase {
  const char* f;
  bool is_steady;
};

TEST(StepSourcesTest, KnowsWhereFormulasAreConstant) {
  const std::vector<SteadyCase> cases = {
      {"3", true},
      {"t", false},
      {"0.1*(t < 1) + 0.3", true},
      {"(t >= 0.3)*((t - 0.3 - 0.5*floor((t - 0.3)/0.5)) < 0.25)", true},
      {"0.1*floor(3*t) + sign(cos(9*t))", true},
      {"max(0, sin(7*t))", false},
      {"min(2, max(t, 3))", true},
      {"(t < 1)*t", false},
      {"sin(t)/t", false},
      {"(sin(9*t) > 0.5) + 1e-9*t*(t > 1.5)", false},
  };
  for (const SteadyCase& c : cases) {
    SCOPED_TRACE(c.f);
    Problem problem = testing::Scalar(-1, 1, 1, 2);
    problem.f = TimeFunction::Formulas({c.f});
    absl::StatusOr<Sources> sources = Sources::Create(problem);
    ASSERT_TRUE(sources.ok()) << sources.status();
    SourceSampler sampler(*sources);
    std::vector<double> ends = KnownKinks(problem);
    ends.push_back(problem.horizon);
    bool is_steady = true;
    double begin = 0;
    for (const double end : ends) {
      StepSources step;
      sampler.Sample(begin, end, step);
      EXPECT_TRUE(step.finite);
      const bool is_known = sources->FIsSteady(begin, end);
      is_steady = is_steady && is_known;
      if (end < problem.horizon) {
        EXPECT_FALSE(sources->FIsSteady(begin, end + 1e-9)) << "beyond " << end;
      }
      for (int k = 1; is_known && k < 100; ++k) {
        const double t = begin + (end - begin) * k / 100;
        Vector value(1);
        sources->F(t, Side::kRight, value);
        EXPECT_EQ(step.f.values(0, 0), value[0]) << "at t = " << t;
      }
      EXPECT_TRUE(!is_known || (step.f.values.rightCols(kLegendreDegree).array() == 0).all());
      begin = end;
    }
    EXPECT_EQ(is_steady, c.is_steady);
  }
}

}  // namespace
}  // namespace dlcs
