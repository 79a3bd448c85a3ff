// SPDX-License-Identifier: Apache-2.0
#include "core/models/american_option.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/linalg/norms.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::SolveToEnd;

Solution AtMaturity(const AmericanOptionModel& model) {
  const auto problem = MakeAmericanOptionProblem(model);
  EXPECT_TRUE(problem.ok()) << problem.status();
  Options options;
  options.output_times = {problem->horizon};
  options.output_times_only = true;
  return SolveToEnd(*problem, options);
}

// The put at the money by the binomial tree of Cox, Ross and Rubinstein.
double PutByTree(const AmericanOptionModel& model) {
  constexpr int kPeriods = 2000;
  const double dt = model.horizon / kPeriods, up = std::exp(model.volatility * std::sqrt(dt));
  const double discount = std::exp(-model.rate * dt), chance = (1 / discount - 1 / up) / (up - 1 / up);
  std::vector<double> value(kPeriods + 1);
  const auto payoff = [&](int ups, int periods) { return std::max(0.0, 1 - std::pow(up, 2 * ups - periods)); };
  for (int k = 0; k <= kPeriods; ++k) value[k] = payoff(k, kPeriods);
  for (int period = kPeriods - 1; period >= 0; --period) {
    for (int k = 0; k <= period; ++k) {
      const double held = discount * (chance * value[k + 1] + (1 - chance) * value[k]);
      value[k] = std::max(held, payoff(k, period));
    }
  }
  return value[0];
}

TEST(AmericanOptionTest, AgreesWithABinomialTree) {
  const AmericanOptionModel model{.cells = 80, .rate = 0.1, .volatility = 0.2};
  const Solution solution = AtMaturity(model);
  EXPECT_NEAR(solution.x(model.cells / 2 - 1, 0), PutByTree(model), 2e-4);
  EXPECT_GT(solution.y(0, 0), 0) << "far in the money it is exercised at once";
}

TEST(AmericanOptionTest, TwoAssetsThatMoveAsOneAreOne) {
  const AmericanOptionModel one{.cells = 10, .volatility = 0.3};
  AmericanOptionModel two = one;
  two.dimensions = 2;
  two.correlation = 1;
  const Index points = one.cells - 1, middle = one.cells / 2 - 1;
  EXPECT_NEAR(AtMaturity(two).x(middle * points + middle, 0), AtMaturity(one).x(middle, 0), 1e-3);
  // The less they move together, the less the mean moves, and the less its insurance is worth.
  two.correlation = 0;
  const double independent = AtMaturity(two).x(middle * points + middle, 0);
  two.correlation = -0.5;
  const double opposed = AtMaturity(two).x(middle * points + middle, 0);
  EXPECT_LT(independent, AtMaturity(one).x(middle, 0) - 5e-3);
  EXPECT_LT(opposed, independent - 5e-3);
}

TEST(AmericanOptionTest, NamesEachBrokenRule) {
  const auto problem =
      MakeAmericanOptionProblem({.cells = 0, .rate = -1, .volatility = 0, .correlation = 2, .horizon = 0});
  EXPECT_THAT(problem.status().message(), AllOf(HasSubstr("cells"), HasSubstr("rate: is -1"), HasSubstr("volatility"),
                                                HasSubstr("correlation: is 2"), HasSubstr("horizon")));
}

}  // namespace
}  // namespace dlcs
