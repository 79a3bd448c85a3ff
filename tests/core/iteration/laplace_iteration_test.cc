// SPDX-License-Identifier: Apache-2.0

#include "core/iteration/laplace_iteration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

class Recording : public Observer {
 public:
  void OnIterate(const IterateReport& report, const IterateValues& values) override {
    iterates.push_back(report);
    times.assign(values.times.begin(), values.times.end());
    y = values.y;
  }
  void OnWindowFinished(const WindowOutcome& outcome) override { windows.push_back(outcome); }
  std::vector<IterateReport> iterates;
  std::vector<double> times;  // of the last iterate
  Matrix y;
  std::vector<WindowOutcome> windows;
};

Solution Iterate(const Problem& problem, Index steps, Index window, Observer& observer, int threads = 0) {
  Options options;
  options.method = Method::kLaplaceIteration;
  options.num_steps = steps;
  options.window_steps = window;
  options.num_threads = threads;
  auto solution = Solve(problem, options, observer, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}

double ErrorOfExampleFourOne(const Solution& solution) {
  double error = 0;
  for (size_t k = 0; k < solution.times.size(); ++k) {
    error = NanMax(error, MaxAbs(solution.x.col(k) - testing::ExampleFourOneExact(solution.times[k])));
  }
  return error;
}

TEST(LaplaceIterationTest, ReachesTheClosedFormOfExampleFourOneWithOrderTwo) {
  Observer silent;
  const Solution coarse = Iterate(testing::ExampleFourOne(), 2000, 0, silent);
  const Solution fine = Iterate(testing::ExampleFourOne(), 4000, 0, silent);
  const Solution finest = Iterate(testing::ExampleFourOne(), 128000, 0, silent);
  ASSERT_EQ(finest.termination, Termination::kReachedEnd) << finest.message;
  EXPECT_NEAR(std::log2(ErrorOfExampleFourOne(coarse) / ErrorOfExampleFourOne(fine)), 2, 0.1);
  EXPECT_LT(ErrorOfExampleFourOne(finest), 1e-10);
  // Least element throughout: the second and third multiplier never rise.
  EXPECT_EQ(MaxAbs(finest.y.middleRows(1, 2)), 0);
  EXPECT_LT(finest.certificate.node_residual, 1e-12);
}

TEST(LaplaceIterationTest, ConvergesOnTheHardFourVariableDataWithWindows) {
  const Vector reference{{0.091747, -0.200648, 0.497778}};
  Observer silent;
  for (const Index steps : {64, 256}) {
    const Solution solution = Iterate(testing::FourVariableHard(), steps, 0, silent);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << steps << ": " << solution.message;
    const double error = MaxAbs(solution.x.rightCols(1) - reference);
    EXPECT_LT(error, steps == 256 ? 1e-3 : 2e-2) << steps;
    EXPECT_LT(solution.certificate.node_residual, 1e-9);
  }
}

TEST(LaplaceIterationTest, ReportsTheDivergenceOfAWindowThatMayNotShrink) {
  Observer silent;
  const Solution solution = Iterate(testing::FourVariableHard(), 256, Options::kWholeHorizon, silent);
  EXPECT_EQ(solution.termination, Termination::kDiverged) << solution.message;
  EXPECT_NE(solution.message.find("Automatic windows"), std::string::npos) << solution.message;
}

TEST(LaplaceIterationTest, ConvergesSuperlinearlyBelowItsBoundOnTheEasyData) {
  for (const Index steps : {32, 128}) {
    Recording recording;
    const Solution solution = Iterate(testing::FourVariableEasy(), steps, Options::kWholeHorizon, recording);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    const size_t count = recording.iterates.size();
    EXPECT_LE(count, 21u);
    EXPECT_GE(count, 15u);
    for (const IterateReport& iterate : recording.iterates) {
      if (iterate.change < 1e-13) continue;  // rounding
      ASSERT_TRUE(iterate.log10_bound.has_value());
      EXPECT_LE(std::log10(iterate.change), *iterate.log10_bound + 1e-9) << iterate.iteration;
    }
    // Superlinear: behind the hump every contraction is stronger than the one before.
    const auto contraction = [&](size_t k) { return recording.iterates[k].change / recording.iterates[k - 1].change; };
    for (size_t k = count / 2 + 1; k + 1 < count; ++k) EXPECT_LT(contraction(k), contraction(k - 1)) << k;
    EXPECT_EQ(MaxAbs(solution.y.row(0)), 0);
    EXPECT_EQ(MaxAbs(solution.y.row(2)), 0);
    EXPECT_GT(MaxAbs(solution.y.row(1)), 0.1);
    EXPECT_GT(MaxAbs(solution.y.row(3)), 0.1);
  }
}

TEST(LaplaceIterationTest, AgreesWithTheMarchOnEveryNode) {
  for (const Problem& problem : {testing::FourVariableHard(), testing::FourVariableEasy(), testing::ExampleFourOne()}) {
    Observer silent;
    const Solution iterated = Iterate(problem, 512, 0, silent);
    Options options;
    options.method = Method::kExponentialIntegrator;
    options.num_steps = 512;
    const auto marched = Solve(problem, options, silent, {});
    ASSERT_TRUE(marched.ok());
    ASSERT_EQ(marched->termination, Termination::kReachedEnd) << marched->message;
    EXPECT_LT(MaxAbs(iterated.x - marched->x), 1e-10);
    EXPECT_LT(MaxAbs(iterated.y - marched->y), 1e-9);
  }
}

// x grows by up to 1e8: an error of y at early times, small beside the largest x, is as large as that at the end.
TEST(LaplaceIterationTest, AcceleratedIsRightOrNotConvergedWhereStatesGrow) {
  constexpr Index kSteps = 100;
  Index converged = 0;
  for (const auto& [feedback, coupling] : {std::pair{8.6, 2.4}, {8.1, -2.3}, {6.4, 1.0}, {5.0, 0.5}, {3.6, -1.6}}) {
    Problem problem;
    problem.A = Matrix{{-1, 0.5}, {coupling, -2}};
    problem.B = Matrix{{feedback, 0}, {1, feedback}};
    problem.N = Matrix{{-1, 0.2}, {0, -1}};
    problem.M = Matrix{{1, 0.3}, {0, 1}};
    problem.f = TimeFunction::Formulas({"sin(t)", "1"});
    problem.g = TimeFunction::Formulas({"0.3", "-0.2"});
    problem.x0 = Vector{{1, 0.5}};
    problem.horizon = 3;
    Options options;
    options.method = Method::kExponentialIntegrator;
    options.num_steps = kSteps;
    options.estimate_error = false;
    Observer silent;
    const auto march = Solve(problem, options, silent, {});
    ASSERT_TRUE(march.ok());
    options.method = Method::kLaplaceIteration;
    options.window_steps = Options::kWholeHorizon;
    for (const int depth : {1, 2, 5, 20}) {
      options.acceleration = depth;
      const auto iterated = Solve(problem, options, silent, {});
      ASSERT_TRUE(iterated.ok());
      if (iterated->termination != Termination::kReachedEnd) continue;
      ++converged;
      EXPECT_LE(MaxAbs(iterated->x - march->x), 1e-8 * MaxAbs(march->x)) << feedback << " " << depth;
    }
  }
  EXPECT_GE(converged, 8);
}

TEST(LaplaceIterationTest, HasTheSameBitsForAnyNumberOfThreads) {
  Observer silent;
  const Solution one = Iterate(testing::FourVariableEasy(), 3000, Options::kWholeHorizon, silent, 1);
  for (const int threads : {2, 4}) {
    const Solution many = Iterate(testing::FourVariableEasy(), 3000, Options::kWholeHorizon, silent, threads);
    EXPECT_TRUE((one.x.array() == many.x.array()).all());
    EXPECT_TRUE((one.y.array() == many.y.array()).all());
  }
}

TEST(LaplaceIterationTest, GivesTheSameAnswerForAnyWindow) {
  Observer silent;
  const Solution reference = Iterate(testing::FourVariableEasy(), 300, Options::kWholeHorizon, silent);
  for (const Index window : {1, 7, 64, 200}) {
    const Solution solution = Iterate(testing::FourVariableEasy(), 300, window, silent);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_LT(MaxAbs(reference.x - solution.x), 1e-11) << window;
  }
}

// Steps of two lengths that alternate: windows go across them, as many and as wide as on equal steps.
Solution IterateInFlight(const Problem& problem, Index window, Index in_flight, int threads = 1) {
  Options options;
  options.method = Method::kLaplaceIteration;
  options.num_steps = 256;
  options.window_steps = window;
  options.windows_in_flight = in_flight;
  options.num_threads = threads;
  return testing::SolveToEnd(problem, options);
}

// The hard data has windows that leave the feasible states while the one before them has not converged.
TEST(LaplaceIterationTest, WindowsInFlightGiveTheSameAnswerWithTheSameBitsForAnyThreads) {
  for (const Problem& problem :
       {testing::FourVariableEasy(), testing::FourVariableHard(), *MakeSignoriniProblem({.cells = 12, .horizon = 1})}) {
    for (const Index window : {0, 8}) {
      const Solution one = IterateInFlight(problem, window, 1);
      const Solution three = IterateInFlight(problem, window, 3);
      const Solution on_two_threads = IterateInFlight(problem, window, 3, 2);
      EXPECT_LT(MaxAbs(one.x - three.x), 1e-10 * MaxAbs(one.x));
      EXPECT_LT(MaxAbs(one.y - three.y), 1e-10 * MaxAbs(one.y));
      EXPECT_EQ(three.x, on_two_threads.x);
      EXPECT_EQ(three.y, on_two_threads.y);
      EXPECT_LT(three.certificate.node_residual, 1e-10);
    }
  }
}

// A window that was in flight has little left to do when its turn comes.
TEST(LaplaceIterationTest, WindowsInFlightTakeFewerIterationsOneAfterTheOther) {
  const Problem problem = testing::FourVariableEasy();
  EXPECT_LT(IterateInFlight(problem, 16, 4).cost.iterations, 0.8 * IterateInFlight(problem, 16, 1).cost.iterations);
}

TEST(LaplaceIterationTest, TakesWindowsAcrossStepsOfUnequalLength) {
  const auto solve = [](const Problem& problem, Method method, const std::vector<double>& times, Index window) {
    Options options;
    options.method = method;
    options.grid_times = times;
    options.window_steps = window;
    Observer silent;
    return *Solve(problem, options, silent, {});
  };
  for (const Problem& problem : {testing::FourVariableEasy(), testing::FourVariableHard(), testing::ExampleFourOne()}) {
    std::vector<double> equal, alternating, growing;
    constexpr Index kPairs = 256;
    for (Index k = 0; k < kPairs; ++k) {
      const double t = problem.horizon * static_cast<double>(k) / kPairs, step = problem.horizon / kPairs;
      equal.insert(equal.end(), {t, t + step / 2});
      alternating.insert(alternating.end(), {t, t + step / 3});
      const double s = static_cast<double>(2 * k) / (2 * kPairs);
      growing.push_back(problem.horizon * (0.7 * s + 0.3 * s * s));
    }
    for (const std::vector<double>& times : {alternating, growing}) {
      const Solution marched = solve(problem, Method::kExponentialIntegrator, times, 0);
      const Solution found = solve(problem, Method::kLaplaceIteration, times, 0);
      ASSERT_EQ(found.termination, Termination::kReachedEnd) << found.message;
      EXPECT_LT(MaxAbs(found.x - marched.x), 1e-10);
      EXPECT_LT(MaxAbs(found.y - marched.y), 1e-9);
      EXPECT_LT(found.cost.windows, static_cast<Index>(times.size()) / 4);
    }
    const Solution regular = solve(problem, Method::kLaplaceIteration, equal, 0);
    const Solution across = solve(problem, Method::kLaplaceIteration, alternating, 0);
    EXPECT_LE(across.cost.windows, regular.cost.windows * 3 / 2 + 2);
    EXPECT_LE(across.cost.lcps, regular.cost.lcps * 3 / 2);
  }
  // A fixed width is that width, and the whole horizon one window, whatever the lengths.
  const Problem easy = testing::FourVariableEasy();
  std::vector<double> alternating;
  for (Index k = 0; k < 32; ++k) alternating.insert(alternating.end(), {k / 32.0, k / 32.0 + 0.01});
  const Solution whole = solve(easy, Method::kLaplaceIteration, alternating, Options::kWholeHorizon);
  ASSERT_EQ(whole.termination, Termination::kReachedEnd) << whole.message;
  EXPECT_EQ(whole.cost.windows, 1);
  EXPECT_EQ(solve(easy, Method::kLaplaceIteration, alternating, 16).cost.windows, 4);
}

TEST(LaplaceIterationTest, MarchesAStepThatDoesNotConverge) {
  // Near the equilibrium x = 20 y, y = 10 (1 - x): with h = 1 an iteration on one step has the factor -200 φ_2(-1).
  Problem problem = testing::Scalar(-1, -1, 0.99, 4);
  problem.B(0, 0) = 20;
  problem.M(0, 0) = 0.1;
  Recording recording;
  const Solution solution = Iterate(problem, 4, 0, recording);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_EQ(solution.cost.coupled_steps, 4);
  EXPECT_LT(solution.certificate.node_residual, 1e-13);
}

TEST(LaplaceIterationTest, ShowsTheFunctionOfEachIterate) {
  Recording whole;
  const Solution one_window = Iterate(testing::FourVariableEasy(), 64, Options::kWholeHorizon, whole);
  ASSERT_EQ(one_window.termination, Termination::kReachedEnd);
  EXPECT_EQ(whole.times, one_window.times);
  EXPECT_TRUE((whole.y.array() == one_window.y.array()).all());

  Recording last;
  const Solution windows = Iterate(testing::FourVariableEasy(), 64, 16, last);
  ASSERT_EQ(windows.termination, Termination::kReachedEnd);
  ASSERT_EQ(last.times.size(), 17u);
  EXPECT_EQ(last.times.front(), windows.times[48]);
  EXPECT_TRUE((last.y.array() == windows.y.rightCols(17).array()).all());
}

TEST(LaplaceIterationTest, StopsOnRequestBetweenIterates) {
  class StopAtFirst : public Observer {
   public:
    void OnIterate(const IterateReport&, const IterateValues&) override { source.request_stop(); }
    std::stop_source source;
  } observer;
  Options options;
  options.method = Method::kLaplaceIteration;
  options.num_steps = 1000;
  const auto solution = Solve(testing::FourVariableEasy(), options, observer, observer.source.get_token());
  ASSERT_TRUE(solution.ok());
  EXPECT_EQ(solution->termination, Termination::kCancelled);
}

}  // namespace
}  // namespace dlcs
