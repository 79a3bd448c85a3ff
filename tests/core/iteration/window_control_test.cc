// SPDX-License-Identifier: Apache-2.0
// How wide windows become, for iterations that grow with the width as known systems have them.
#include "core/iteration/window_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace dlcs {
namespace {

using Iterations = std::function<double(double width)>;  // as many as 300, or it fails

// What `steps` steps cost from a first window on, in iterations of one step and sixteen of overhead.
double Cost(const Iterations& iterations, Index first, Index steps) {
  WindowWidth width(first);
  double cost = 0;
  for (Index done = 0; done < steps;) {
    const Index window = std::min(width.value(), steps - done);
    const double taken = std::round(iterations(static_cast<double>(window)));
    const bool fails = taken > kMaxIterationsOfShrinking;
    cost += std::min(taken, 60.0) * static_cast<double>(fails) * static_cast<double>(window + 16);
    if (fails) {
      width.Reject(window);
      continue;
    }
    cost += taken * static_cast<double>(window + 16);
    width.Accept(window, static_cast<Index>(taken));
    done += window;
  }
  return cost;
}

double CostOfTheBestFixedWidth(const Iterations& iterations, Index steps) {
  double best = 1e300;
  for (Index width = 1; width <= kLongestWindow; width *= 2) {
    const double taken = std::round(iterations(static_cast<double>(width)));
    if (taken > kMaxIterationsOfShrinking) continue;
    const double windows = std::ceil(static_cast<double>(steps) / static_cast<double>(width));
    best = std::min(best, windows * taken * static_cast<double>(width + 16));
  }
  return best;
}

TEST(WindowWidthTest, IsNearTheBestFixedOneHoweverIterationsGrow) {
  const auto power = [](double factor, double exponent) {
    return [=](double width) { return factor * std::pow(width, exponent); };
  };
  const auto hump = [](double width) { return width <= 24 ? 8 + width : 1e9; };  // no window of more converges
  const Index steps = 4000;
  for (const Iterations& iterations :
       {Iterations(power(28, 0.45)), Iterations(power(60, 0.4)), Iterations(power(6, 0.1)), Iterations(power(5, 0.5)),
        Iterations(power(22, 0)), Iterations(power(25, 1)), Iterations(power(3, 1)), Iterations(hump)}) {
    for (const Index first : {1, 16}) {
      const double best = CostOfTheBestFixedWidth(iterations, steps);
      EXPECT_LE(Cost(iterations, first, steps), 1.5 * best) << iterations(1) << " " << iterations(16) << " " << first;
    }
  }
}

// Where diffusion carries y to y, one step takes many iterations, and sixteen hardly three times as many.
TEST(WindowWidthTest, GrowsFromOneStepWhereIterationsGrowSlowly) {
  WindowWidth width(1);
  Index widest = 1;
  for (int k = 0; k < 20; ++k) {
    width.Accept(width.value(), static_cast<Index>(28 * std::sqrt(static_cast<double>(width.value()))));
    widest = std::max(widest, width.value());
    EXPECT_GE(width.value(), std::min<Index>(4, Index{1} << (k + 1)));
  }
  EXPECT_GE(widest, 16);
  EXPECT_LE(widest, 64);
}

TEST(RelativeChangeTest, ARowTenDigitsBelowTheLargestCountsByItsOwnSize) {
  const Vector size{{1, 1e-10}};
  EXPECT_DOUBLE_EQ(RelativeChange(size, Vector{{0.125, 0.5e-10}}), 0.5);
  // One that is only the rounding of the largest does not.
  EXPECT_LE(RelativeChange(Vector{{1, 1e-16}}, Vector{{0, 1e-16}}), 1e-6);
}

TEST(WindowWidthTest, DoublesWhereIterationsAreFewAndHalvesWhereAWindowFails) {
  WindowWidth width(16);
  width.Accept(16, 8);
  EXPECT_EQ(width.value(), 32);
  width.Accept(32, 15);
  EXPECT_EQ(width.value(), 32);
  width.Reject(32);
  EXPECT_EQ(width.value(), 16);
  width.AcceptCoupledStep();
  EXPECT_EQ(width.value(), 1);
  width.Accept(1, 2);
  EXPECT_EQ(width.value(), 2);
}

}  // namespace
}  // namespace dlcs
