// SPDX-License-Identifier: Apache-2.0

#include "core/parallel/stop_scope.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/analyze.h"
#include "core/ensemble.h"
#include "core/lcp/lcp.h"
#include "core/nonlinear/solve_nonlinear.h"
#include "core/parallel/parallel.h"
#include "core/setup_cache.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

TEST(StopScopeTest, ScopesNest) {
  std::stop_source stop;
  stop.request_stop();
  LookForStop();
  {
    const StopScope outer(stop.get_token());
    EXPECT_THROW(LookForStop(), Stopped);
    {
      const StopScope inner(nullptr);
      EXPECT_NO_THROW(LookForStop());
    }
    EXPECT_THROW(LookForStop(), Stopped);
  }
  EXPECT_NO_THROW(LookForStop());
}

TEST(StopScopeTest, WorkersCarryItAndWhatIsThrown) {
  std::stop_source stop;
  Workers workers(4);
  const StopScope scope(stop.get_token());
  std::atomic<int> bodies = 0, seen = 0;
  EXPECT_THROW(workers.ForBlocks(64, 1,
                                 [&](Index, Index, Index) {
                                   ++bodies;
                                   if (bodies == 8) stop.request_stop();
                                   if (StopScope::Current() != nullptr) ++seen;
                                   LookForStop();
                                 }),
               Stopped);
  EXPECT_EQ(seen, bodies);
  EXPECT_GE(bodies, 8);
}

// Stops the solve when it has told of so many windows.
class Stopper final : public Observer {
 public:
  explicit Stopper(int windows) : left_(windows) {}
  void OnWindowFinished(const WindowOutcome& outcome) override {
    reached = outcome.end;
    if (--left_ == 0) stop.request_stop();
  }
  void OnIterate(const IterateReport&, const IterateValues&) override { iterates_since_stop += stop.stop_requested(); }
  std::stop_source stop;
  double reached = 0;
  int iterates_since_stop = 0;

 private:
  int left_;
};

TEST(StopScopeTest, WhatWasFoundBeforeAStopIsKept) {
  Options options;
  options.method = Method::kLaplaceIteration;
  options.num_steps = 4000;
  options.window_steps = 10;
  Stopper stopper(20);
  const auto solution = Solve(testing::FourVariableEasy(), options, stopper, stopper.stop.get_token());
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->termination, Termination::kCancelled);
  EXPECT_GE(solution->times.size(), 200u);
  EXPECT_EQ(static_cast<Index>(solution->times.size()), solution->x.cols());
  EXPECT_NEAR(solution->times.back(), stopper.reached, 20 * solution->step);
}

// One window, each step of which takes some 2^18 multiplications to file.
struct WideWindow {
  explicit WideWindow(Method method, Index steps) {
    const Index m = 256;
    problem.A = testing::RandomMatrix(m, m, 1) / 16 - 2 * Matrix::Identity(m, m);
    problem.B = Matrix::Constant(m, 1, 0.01);
    problem.N = Matrix::Constant(1, m, 0.01);
    problem.M = Matrix::Identity(1, 1);
    problem.f = TimeFunction::Constant(Vector::Zero(m));
    problem.g = TimeFunction::Formulas({"sin(9*t)"});
    problem.x0 = Vector::Ones(m);
    problem.horizon = 1;
    options.method = method;
    options.num_steps = steps;
    options.window_steps = Options::kWholeHorizon;
    options.num_threads = 1;
  }
  Problem problem;
  Options options;
};

TEST(StopScopeTest, FilingOfAWindowIsStoppedBetweenPanels) {
  const WideWindow wide(Method::kLaplaceIteration, 512);
  Stopper stopper(1);  // when the window has converged and is about to be filed
  const auto solution = Solve(wide.problem, wide.options, stopper, stopper.stop.get_token());
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->termination, Termination::kCancelled);
  EXPECT_GE(solution->times.size(), 2u);  // what was filed before is kept
  EXPECT_LE(solution->times.size(), 200u);
  EXPECT_EQ(solution->failure_time, solution->times.back());
}

TEST(StopScopeTest, FilingByPanelsLosesNothing) {
  Observer nobody;
  const WideWindow iterated(Method::kLaplaceIteration, 512), marched(Method::kExponentialIntegrator, 512);
  const auto by_panels = Solve(iterated.problem, iterated.options, nobody, {});
  const auto by_chunks = Solve(marched.problem, marched.options, nobody, {});
  ASSERT_TRUE(by_panels.ok()) << by_panels.status();
  ASSERT_TRUE(by_chunks.ok()) << by_chunks.status();
  EXPECT_EQ(by_panels->termination, Termination::kReachedEnd);
  EXPECT_EQ(by_panels->times.size(), 513u);
  EXPECT_TRUE(by_panels->left_limits.empty());
  const Certificate &panels = by_panels->certificate, &chunks = by_chunks->certificate;
  EXPECT_GT(chunks.midpoint_residual, 0);
  EXPECT_NEAR(panels.midpoint_residual, chunks.midpoint_residual, 1e-9 * chunks.lcp_scale);
  EXPECT_NEAR(panels.lcp_scale, chunks.lcp_scale, 1e-9 * chunks.lcp_scale);
  EXPECT_NEAR(panels.ode_scale, chunks.ode_scale, 1e-9 * chunks.ode_scale);
  EXPECT_NEAR(panels.x_scale, chunks.x_scale, 1e-9 * chunks.x_scale);
}

TEST(StopScopeTest, AnEnsembleThatIsStoppedWhileItIsClassifiedBeginsNoMember) {
  std::stop_source stop;
  stop.request_stop();
  Problem base = testing::FourVariableEasy();
  const Matrix M = testing::RandomMatrix(40, 40, 2);
  base.M = M - M.transpose();
  base.B = Matrix::Zero(base.num_states(), 40);
  base.N = Matrix::Zero(40, base.num_states());
  base.g = TimeFunction::Constant(Vector::Ones(40));
  int ended = 0;
  const absl::Status status = SolveEnsemble(
      base, std::vector<EnsembleMember>(3), {},
      [&](Index, const Solution& solution) {
        ++ended;
        EXPECT_EQ(solution.termination, Termination::kCancelled);
        EXPECT_EQ(solution.x.cols(), 0);
      },
      stop.get_token());
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(ended, 3);
}

TEST(StopScopeTest, ASplittingThatIsStoppedIteratesNoMore) {
  NonlinearProblem problem;
  problem.f = {"-x1**3 + y1 + sin(5*t)"};
  problem.g = {"y1 + 0.5*y1**3 + x1 - cos(3*t)"};
  problem.x0 = Vector::Ones(1);
  problem.horizon = 10;
  Options options;
  options.num_steps = 4000;
  options.num_threads = 1;
  Stopper stopper(3);
  const auto solution = SolveNonlinear(problem, options, stopper, stopper.stop.get_token());
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->termination, Termination::kCancelled);
  EXPECT_EQ(stopper.iterates_since_stop, 0);
}

TEST(StopScopeTest, StoppedFromTheBeginningIsCancelledAndEmpty) {
  std::stop_source stop;
  stop.request_stop();
  Observer nobody;
  for (const Method method : {Method::kAuto, Method::kLaplaceIteration, Method::kWuChenIteration,
                              Method::kExponentialIntegrator, Method::kTimeStepping, Method::kEventDriven}) {
    Options options;
    options.method = method;
    const auto solution = Solve(testing::FourVariableEasy(), options, nobody, stop.get_token());
    ASSERT_TRUE(solution.ok()) << solution.status();
    EXPECT_EQ(solution->termination, Termination::kCancelled);
    EXPECT_EQ(static_cast<Index>(solution->times.size()), solution->x.cols());
    EXPECT_LE(solution->times.size(), 1u);
  }
  const Matrix M = testing::RandomMatrix(40, 40, 1);
  const Matrix skew = M - M.transpose();
  EXPECT_TRUE(absl::IsCancelled(SolveLcp(skew, -Vector::Ones(40), LcpRequest{}, stop.get_token()).status()));
  const auto analysis = Analyze(testing::FourVariableEasy(), {}, stop.get_token());
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  EXPECT_FALSE(analysis->warnings.empty());
}

// Waits until `flag` is set.
void WaitFor(const std::atomic<bool>& flag) {
  while (!flag) std::this_thread::yield();
}

TEST(StopScopeTest, OneWhoIsStoppedLeavesItsSetupToThoseWhoWait) {
  SetupCache cache(1e6);
  const SetupKey key("number");
  std::stop_source stop;
  std::atomic<bool> is_making = false;
  std::thread stopped([&] {
    const StopScope scope(stop.get_token());
    EXPECT_THROW(cache.Get<int>(key,
                                [&]() -> SetupCache::Made<int> {
                                  is_making = true;
                                  for (;;) LookForStop();
                                }),
                 Stopped);
  });
  WaitFor(is_making);
  std::thread waiting([&] {
    const auto value = cache.Get<int>(key, [] { return SetupCache::Made<int>{std::make_shared<const int>(7), 4}; });
    EXPECT_EQ(*value, 7);
  });
  stop.request_stop();
  stopped.join();
  waiting.join();
}

TEST(StopScopeTest, OneWhoWaitsForAnothersSetupIsStopped) {
  SetupCache cache(1e6);
  const SetupKey key("number");
  std::atomic<bool> is_making = false, may_end = false;
  std::thread maker([&] {
    cache.Get<int>(key, [&] {
      is_making = true;
      WaitFor(may_end);
      return SetupCache::Made<int>{std::make_shared<const int>(7), 4};
    });
  });
  WaitFor(is_making);
  std::stop_source stop;
  stop.request_stop();
  {
    const StopScope scope(stop.get_token());
    EXPECT_THROW(cache.Get<int>(key, [] { return SetupCache::Made<int>{}; }), Stopped);
  }
  may_end = true;
  maker.join();
}

}  // namespace
}  // namespace dlcs
