// SPDX-License-Identifier: Apache-2.0

#include "core/iteration/interpolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

Matrix Sampled(const Grid& grid, double (*function)(double)) {
  const NodeColumns columns(grid);
  Matrix values(1, columns.CountAll());
  for (Index c = 0; c < columns.CountAll(); ++c) values(0, c) = function(columns.Time(c));
  return values;
}

double ErrorBetweenNodes(const Grid& grid, const std::vector<InterpolatedRun>& pieces, double (*function)(double)) {
  double error = 0;
  for (size_t r = 0; r < grid.runs.size(); ++r) {
    for (Index l = 0; l < grid.runs[r].steps; ++l) {
      for (const double theta : {0.0, 0.2, 0.5, 0.9, 1.0}) {
        double value = 0, power = 1;
        for (const Matrix& coefficient : pieces[r].coefficients) {
          value += coefficient(0, l) * std::exchange(power, power * theta);
        }
        const double t = grid.times[grid.runs[r].first_node + l] + theta * grid.runs[r].step;
        error = NanMax(error, std::abs(value - function(t)));
      }
    }
  }
  return error;
}

double Cubic(double t) { return 1 + t * (2 - t * (3 - 0.7 * t)); }
double Parabola(double t) { return 1 + t * (2 - 3 * t); }
double Line(double t) { return 2 - 3 * t; }
double Smooth(double t) { return std::exp(std::sin(3 * t)); }

// Steps of two lengths, and all of different lengths.
std::vector<Grid> Grids(Index steps) {
  Options uniform, growing, split;
  uniform.num_steps = steps;
  split.num_steps = steps;
  split.output_times = {0.3, 0.31};
  for (Index k = 0; k <= steps; ++k) {
    const double s = static_cast<double>(k) / static_cast<double>(steps);
    growing.grid_times.push_back(s + 0.3 * s * (1 - s));
  }
  return {MakeGrid(1, {}, uniform), MakeGrid(1, {}, growing), MakeGrid(1, {}, split)};
}

TEST(InterpolationTest, ReproducesPolynomials) {
  for (const Grid& grid : Grids(7)) {
    EXPECT_LT(ErrorBetweenNodes(grid, Interpolate(Interpolation::kLinear, grid, Sampled(grid, Line)), Line), 1e-14);
    EXPECT_LT(ErrorBetweenNodes(grid, Interpolate(Interpolation::kCubicSpline, grid, Sampled(grid, Cubic)), Cubic),
              1e-13);
  }
}

TEST(InterpolationTest, IsOfOrderTwoAndFourOnSmoothFunctions) {
  const std::vector<Grid> coarse = Grids(40), fine = Grids(80);
  for (size_t k = 0; k < coarse.size(); ++k) {
    const auto order = [&](Interpolation kind) {
      const auto error = [&](const Grid& grid) {
        return ErrorBetweenNodes(grid, Interpolate(kind, grid, Sampled(grid, Smooth)), Smooth);
      };
      return std::log2(error(coarse[k]) / error(fine[k]));
    };
    EXPECT_NEAR(order(Interpolation::kLinear), 2, 0.15) << k;
    EXPECT_NEAR(order(Interpolation::kCubicSpline), 4, 0.4) << k;
  }
}

TEST(InterpolationTest, DoesNotSmoothBreakPoints) {
  Options options;
  options.num_steps = 20;
  const Grid grid = MakeGrid(1, {0.37}, options);
  const NodeColumns columns(grid);
  Matrix values(1, columns.CountAll());
  for (Index c = 0; c < columns.CountAll(); ++c) {
    const double t = columns.Time(c);
    values(0, c) = c < columns.First(1) ? Cubic(t) : 5 - Cubic(t);
  }
  const auto pieces = Interpolate(Interpolation::kCubicSpline, grid, values);
  const double end = grid.runs[0].step * 0.5;
  double value = 0, power = 1;
  for (const Matrix& c : pieces[0].coefficients) {
    value += c(0, grid.runs[0].steps - 1) * std::exchange(power, power * 0.5);
  }
  EXPECT_NEAR(value, Cubic(0.37 - end), 1e-13);
}

TEST(InterpolationTest, TakesAParabolaOrALineWhereNodesAreFew) {
  for (const Index steps : {1, 2}) {
    Options options;
    options.num_steps = steps;
    const Grid grid = MakeGrid(1, {}, options);
    double (*function)(double) = steps == 1 ? Line : Parabola;
    EXPECT_LT(
        ErrorBetweenNodes(grid, Interpolate(Interpolation::kCubicSpline, grid, Sampled(grid, function)), function),
        1e-14);
  }
}

}  // namespace
}  // namespace dlcs
