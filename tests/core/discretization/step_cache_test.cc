// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/step_cache.h"

#include <gtest/gtest.h>

#include <memory>

namespace dlcs {
namespace {

TEST(StepCacheTest, StepsBetweenThousandsOfDecimalTimesAreOne) {
  int made = 0;
  StepCache<double> cache([&made](double step) {
    ++made;
    return std::make_unique<double>(step);
  });
  for (int k = 0; k < 5000; ++k) cache.At(0.1 * (k + 1) - 0.1 * k);
  EXPECT_EQ(made, 1);
}

TEST(StepCacheTest, StepsThatAreNotEqualAreNotShared) {
  int made = 0;
  StepCache<double> cache([&made](double step) {
    ++made;
    return std::make_unique<double>(step);
  });
  for (const double step : {0.1, 0.1 * (1 + 1e-11), 0.1}) EXPECT_EQ(cache.At(step), step);
  EXPECT_EQ(made, 2);
}

}  // namespace
}  // namespace dlcs
