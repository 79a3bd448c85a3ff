// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/step_sources.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

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
  SourceSampler sampler(*sources, ProbeTimes(problem));
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

}  // namespace
}  // namespace dlcs
