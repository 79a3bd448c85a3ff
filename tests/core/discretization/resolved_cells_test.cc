// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/resolved_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/problems.h"

namespace dlcs {
namespace {

Problem WithSource(const std::string& f, double horizon) {
  Problem problem = testing::Scalar(-1, 1, 1, horizon);
  problem.f = TimeFunction::Formulas({f});
  return problem;
}

// The cells of [0, T], one after the other.
std::vector<double> EndsOfCells(const Problem& problem) {
  ResolvedCells cells(problem);
  std::vector<double> ends = {0};
  while (ends.back() < problem.horizon) {
    const double reach = cells.Reach(ends.back(), problem.horizon);
    const std::vector<double> times = cells.TimesToCheck(ends.back(), reach);
    EXPECT_EQ(times.size() % ResolvedCells::kTimesOfCell, 0);
    for (std::size_t k = 0; k < times.size(); k += ResolvedCells::kTimesOfCell) {
      // The first and the last Chebyshev point are as far from the ends of the cell.
      const double center = (times[k] + times[k + ResolvedCells::kTimesOfCell - 1]) / 2;
      ends.push_back(ends.back() + 2 * (center - ends.back()));
    }
    if (times.empty()) break;
    ends.back() = reach;
  }
  return ends;
}

TEST(ResolvedCellsTest, APulseHasCellsShorterThanItselfHoweverShortItIs) {
  for (const double width : {1e-2, 1e-5, 1e-8}) {
    SCOPED_TRACE(width);
    const std::string d = "((t - 0.5123)/" + std::to_string(width * 1e9) + "e-9)";
    for (const std::string& pulse : {"exp(-" + d + "**2)", "1/(1 + " + d + "**2)", "1/cosh(" + d + ")**2"}) {
      SCOPED_TRACE(pulse);
      const std::vector<double> ends = EndsOfCells(WithSource(pulse, 1));
      EXPECT_LT(ends.size(), 5000u);
      double shortest = 1;
      for (std::size_t k = 1; k < ends.size(); ++k) {
        if (ends[k - 1] <= 0.5123 && 0.5123 <= ends[k]) shortest = ends[k] - ends[k - 1];
      }
      EXPECT_LT(shortest, 2 * width);
      EXPECT_GT(shortest, width / 50);
    }
  }
}

TEST(ResolvedCellsTest, AnOscillationHasAboutTwoCellsAPeriod) {
  const std::size_t cells = EndsOfCells(WithSource("sin(2*pi*t)", 1000)).size();
  EXPECT_GT(cells, 1000u);
  EXPECT_LT(cells, 3000u);
}

TEST(ResolvedCellsTest, APolynomialHasOne) { EXPECT_EQ(EndsOfCells(WithSource("1 + t**9", 10)).size(), 2u); }

// Where rounding hides the operand of a root there are no derivatives; the cells become short only as long as they show
// anything.
TEST(ResolvedCellsTest, ASingularSourceHasFewCells) {
  for (const char* f :
       {"sqrt(t)", "sqrt(1 - cos(t))", "t**1.5*sin(1/(1 + t))", "sqrt(1e-20*t**4)", "log(t + 1e-300)"}) {
    EXPECT_LT(EndsOfCells(WithSource(f, 6)).size(), 2000u) << f;
  }
}

TEST(ResolvedCellsTest, AStepReachesOverAFewCellsAtMost) {
  const Problem problem = WithSource("sin(1e9*t)", 10);
  ResolvedCells cells(problem);
  const double reach = cells.Reach(0, 10);
  EXPECT_LT(reach, 1e-6);
  EXPECT_EQ(cells.Reach(5, 5 + 1e-10), 5 + 1e-10);
}

// A solve that stopped early, or passed a part of time by other steps, leaves no other cells than one that did not.
TEST(ResolvedCellsTest, AreTheSameWhicheverSolveMadeThem) {
  constexpr double kHorizon = 3;
  const auto cells_of = [](const std::string& f, double beginning, double begin) {
    const Problem problem = WithSource(f, kHorizon);
    ResolvedCells cells(problem);
    for (double t = 0; t < beginning;) t = cells.Reach(t, beginning);
    for (double t = begin; t < kHorizon;) t = cells.Reach(t, kHorizon);
    return cells.CellsIn(begin, kHorizon);
  };
  // Written differently, they share nothing.
  const auto at_once = cells_of("sin(200*t) + 1/(1 + (t - 1)**2)", 0, 0);
  for (const double part : {0.01, 1.0, 2.9}) {
    { ResolvedCells(WithSource("1/(1 + (t - 1)**2) + sin(200*t)", kHorizon)).Reach(0, part); }
    const auto resumed = cells_of("1/(1 + (t - 1)**2) + sin(200*t)", 0, 0);
    ASSERT_EQ(resumed.size(), at_once.size()) << part;
    for (std::size_t k = 0; k < resumed.size(); ++k) EXPECT_EQ(resumed[k], at_once[k]) << part;
  }
  const auto behind_gap = cells_of("2*sin(200*t)", 0.1, 2);
  cells_of("2*sin(200*t)", 0, 0);
  EXPECT_EQ(cells_of("2*sin(200*t)", 0.1, 2), behind_gap);
}

TEST(ResolvedCellsTest, WithoutFormulasNothingIsChecked) {
  Problem problem = testing::Scalar(-1, 1, 1, 2);
  ResolvedCells cells(problem);
  EXPECT_EQ(cells.Reach(0, 2), 2);
  EXPECT_TRUE(cells.TimesToCheck(0, 2).empty());
}

// There rounding hides which operand is the larger one.
TEST(ResolvedCellsTest, WhereSwitchesAreNotFoundTimesAreChecked) {
  const Problem problem = WithSource("max(sin(t), sin(t + 2*pi))", 1);
  ResolvedCells cells(problem);
  EXPECT_FALSE(cells.TimesToCheck(0, cells.Reach(0, 1)).empty());
}

}  // namespace
}  // namespace dlcs
