// SPDX-License-Identifier: Apache-2.0
// Interrupted at every checkpoint and resumed, a solve has the bits of one that was not.
#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/models/signorini.h"
#include "core/problem/observer.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using ::testing::TestWithParam;

struct Case {
  std::string name;
  std::function<Problem()> problem;
  Options options;
};

void PrintTo(const Case& tested, std::ostream* out) { *out << tested.name; }

// Takes every checkpoint, and stops the solve after `last` of them.
class Taker final : public Observer {
 public:
  explicit Taker(std::size_t last) : last_(last) {}

  bool WantsCheckpoint() override { return true; }
  void OnCheckpoint(const Checkpoint& checkpoint) override {
    Append(checkpoint);
    if (++taken == last_) stop.request_stop();
  }

  std::size_t taken = 0;
  ResumePoint point;  // of the last one, with the trajectory since `point` was given
  std::stop_source stop;

 private:
  void Append(const Checkpoint& checkpoint) {
    ASSERT_EQ(checkpoint.first, point.x.cols());
    const Index columns = checkpoint.first + checkpoint.count;
    point.x.conservativeResize(checkpoint.solution.x.rows(), columns);
    point.y.conservativeResize(checkpoint.solution.y.rows(), columns);
    point.w.conservativeResize(checkpoint.solution.w.rows(), columns);
    point.x.rightCols(checkpoint.count) = checkpoint.solution.x.middleCols(checkpoint.first, checkpoint.count);
    point.y.rightCols(checkpoint.count) = checkpoint.solution.y.middleCols(checkpoint.first, checkpoint.count);
    point.w.rightCols(checkpoint.count) = checkpoint.solution.w.middleCols(checkpoint.first, checkpoint.count);
    point.state = checkpoint.state();
  }

  std::size_t last_;
};

bool SameBits(const Matrix& a, const Matrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(double)) == 0;
}

void ExpectSame(const Solution& resumed, const Solution& whole) {
  EXPECT_EQ(resumed.termination, whole.termination) << resumed.message;
  EXPECT_EQ(resumed.times, whole.times);
  EXPECT_TRUE(SameBits(resumed.x, whole.x));
  EXPECT_TRUE(SameBits(resumed.y, whole.y));
  EXPECT_TRUE(SameBits(resumed.w, whole.w));
  EXPECT_EQ(resumed.certificate.node_residual, whole.certificate.node_residual);
  EXPECT_EQ(resumed.certificate.midpoint_residual, whole.certificate.midpoint_residual);
  EXPECT_EQ(resumed.certificate.ode_defect, whole.certificate.ode_defect);
  EXPECT_EQ(resumed.certificate.x_scale, whole.certificate.x_scale);
  EXPECT_EQ(resumed.cost.steps, whole.cost.steps);
  EXPECT_EQ(resumed.cost.lcps, whole.cost.lcps);
  EXPECT_EQ(resumed.cost.windows, whole.cost.windows);
  EXPECT_EQ(resumed.cost.iterations, whole.cost.iterations);
  EXPECT_EQ(resumed.warnings, whole.warnings);
  ASSERT_EQ(resumed.left_limits.size(), whole.left_limits.size());
  for (std::size_t k = 0; k < whole.left_limits.size(); ++k) {
    EXPECT_EQ(resumed.left_limits[k].column, whole.left_limits[k].column);
    EXPECT_EQ(resumed.left_limits[k].y, whole.left_limits[k].y);
    EXPECT_EQ(resumed.left_limits[k].w, whole.left_limits[k].w);
  }
  EXPECT_EQ(resumed.jumps.size(), whole.jumps.size());
  EXPECT_EQ(resumed.kernel.has_value(), whole.kernel.has_value());
  if (whole.kernel) {
    EXPECT_EQ(resumed.kernel->blocks_by_recursion, whole.kernel->blocks_by_recursion);
    EXPECT_EQ(resumed.kernel->blocks_by_contour, whole.kernel->blocks_by_contour);
  }
}

class CheckpointTest : public TestWithParam<Case> {};

// Every attempt begins where the one before left off, takes `stride` checkpoints and is stopped.
void SolveInAttempts(const Case& tested, std::size_t stride, const Solution& whole) {
  const Problem problem = tested.problem();
  ResumePoint resume;
  for (int attempt = 0; attempt < 1000; ++attempt) {
    Taker taker(stride);
    taker.point = resume;
    const auto solution =
        Solve(problem, tested.options, taker, taker.stop.get_token(), nullptr, attempt > 0 ? &resume : nullptr);
    ASSERT_TRUE(solution.ok()) << solution.status();
    resume = taker.point;
    if (solution->termination != Termination::kCancelled) {
      EXPECT_GT(attempt, 0) << "never interrupted";
      ExpectSame(*solution, whole);
      return;
    }
    ASSERT_EQ(taker.taken, stride) << "an attempt that did not get on";
  }
  FAIL() << "a thousand attempts";
}

TEST_P(CheckpointTest, InterruptedAndResumedHasTheSameBits) {
  const Case& tested = GetParam();
  Observer silent;
  const auto whole = Solve(tested.problem(), tested.options, silent, {});
  ASSERT_TRUE(whole.ok()) << whole.status();
  ASSERT_EQ(whole->termination, Termination::kReachedEnd) << whole->message;
  SolveInAttempts(tested, 1, *whole);
  SolveInAttempts(tested, 3, *whole);
}

TEST_P(CheckpointTest, ResumedHasTheSameVerdict) {
  const Case& tested = GetParam();
  Observer silent;
  const auto whole = Solve(tested.problem(), tested.options, silent, {});
  ASSERT_TRUE(whole.ok()) << whole.status();
  Taker taker(2);
  ASSERT_TRUE(Solve(tested.problem(), tested.options, taker, taker.stop.get_token()).ok());
  const auto resumed = Solve(tested.problem(), tested.options, silent, {}, nullptr, &taker.point);
  ASSERT_TRUE(resumed.ok()) << resumed.status();
  ExpectSame(*resumed, *whole);
  const Verdict verdict = JudgeSolution(*resumed), of_whole = JudgeSolution(*whole);
  EXPECT_EQ(verdict.text, of_whole.text);
  EXPECT_EQ(verdict.concerns, of_whole.concerns);
  EXPECT_EQ(verdict.notes, of_whole.notes);
}

// As when a server is told to end while a job of another one is being taken up.
TEST_P(CheckpointTest, AStopBeforeItGoesOnIsNoRefusal) {
  const Case& tested = GetParam();
  Taker taker(1);
  ASSERT_TRUE(Solve(tested.problem(), tested.options, taker, taker.stop.get_token()).ok());
  ASSERT_EQ(taker.taken, 1u);
  Observer silent;
  const auto stopped = Solve(tested.problem(), tested.options, silent, taker.stop.get_token(), nullptr, &taker.point);
  ASSERT_TRUE(stopped.ok()) << stopped.status();
  EXPECT_EQ(stopped->termination, Termination::kCancelled);
}

// The matrices of a step are made again before the solve resumes, and that may be stopped too.
TEST_P(CheckpointTest, AStopWhileItResumesIsNoRefusal) {
  const Case& tested = GetParam();
  Taker taker(1);
  ASSERT_TRUE(Solve(tested.problem(), tested.options, taker, taker.stop.get_token()).ok());
  for (int delay = 0; delay < 20; ++delay) {
    std::stop_source stop;
    const std::jthread stops([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(100 * delay));
      stop.request_stop();
    });
    Observer silent;
    const auto stopped = Solve(tested.problem(), tested.options, silent, stop.get_token(), nullptr, &taker.point);
    ASSERT_TRUE(stopped.ok()) << stopped.status();
  }
}

TEST_P(CheckpointTest, TakingCheckpointsChangesNothing) {
  const Case& tested = GetParam();
  Observer silent;
  const auto whole = Solve(tested.problem(), tested.options, silent, {});
  ASSERT_TRUE(whole.ok());
  Taker taker(0);
  const auto watched = Solve(tested.problem(), tested.options, taker, {});
  ASSERT_TRUE(watched.ok());
  EXPECT_GT(taker.taken, 2u);
  ExpectSame(*watched, *whole);
  EXPECT_TRUE(SameBits(taker.point.x, whole->x.leftCols(taker.point.x.cols())));
  EXPECT_TRUE(SameBits(taker.point.y, whole->y.leftCols(taker.point.y.cols())));
}

Options With(Method method, Index steps) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  return options;
}

Options With(Method method, Index steps, const std::function<void(Options&)>& set) {
  Options options = With(method, steps);
  set(options);
  return options;
}

// Steps of several lengths, and starts of stretches.
Problem Broken(Problem problem) {
  problem.break_points = {0.3 * problem.horizon, 0.71 * problem.horizon};
  return problem;
}

// With the rule said, no other method will have to take over.
Problem LeastElement() {
  Problem problem = testing::FourVariableEasy();
  problem.rule = SolutionRule::kLeastElement;
  return problem;
}

// An ideal diode between two sources that jump: M = 0, and the state jumps with them.
Problem Diode() {
  Problem problem;
  problem.A = Matrix{{-1.0, 2.0}, {-2.0, -0.5}};
  problem.B = Matrix{{1.0}, {0.0}};
  problem.N = Matrix{{1.0, 0.0}};
  problem.M = Matrix::Zero(1, 1);
  problem.x0 = Vector{{1.0, 0.0}};
  problem.horizon = 6;
  problem.f.pieces = {{0, FormulaFunction{{"sin(5*t)", "cos(t)"}}}};
  problem.g.pieces = {{0, ConstantFunction{Vector{{0.2}}}},
                      {2.5, ConstantFunction{Vector{{-1.0}}}},
                      {4, ConstantFunction{Vector{{0.3}}}}};
  return problem;
}

Problem Heated() {
  Problem problem = testing::AdvectedGrid({.side = 8});
  problem.break_points = {0.4};
  return problem;
}

// z' = -z + 1000 (a - b), with a and b equal but for 1e-14: of its 1e-11 rounding leaves no digit. So the estimated
// error is 0.2, or 2e-6 with an absolute tolerance for z.
Problem Cancelling() {
  Problem problem;
  problem.A = Matrix{{-1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}, {1e3, -1e3, -1.0}};
  problem.B = Matrix::Zero(3, 1);
  problem.N = Matrix::Zero(1, 3);
  problem.M = Matrix{{1.0}};
  problem.x0 = Vector{{1.0, 1 + 1e-14, 0.0}};
  problem.horizon = 5;
  problem.f = TimeFunction::Formulas({"sin(t)", "sin(t)", "0"});
  problem.g = TimeFunction::Constant(Vector{{1.0}});
  return problem;
}

Problem Membrane() { return *MakeSignoriniProblem({.cells = 12, .coefficient = 2e-3, .horizon = 1}); }

std::vector<Case> Cases() {
  const auto few_output_times = [](Options& options) {
    for (int k = 0; k <= 40; ++k) options.output_times.push_back(0.9 * k / 40);
    options.output_times_only = true;
  };
  const auto narrow = [](Options& options) { options.window_steps = 70; };
  const auto uneven = [](Options& options) {
    options.num_steps = 0;
    for (int k = 1; k < 900; ++k) options.grid_times.push_back(k / 900.0 + (k % 3) * 2e-4);
  };
  constexpr Method kIterate = Method::kLaplaceIteration, kMarch = Method::kExponentialIntegrator,
                   kStep = Method::kTimeStepping;
  const auto with_propagator = [](PropagatorKind propagator) {
    return [=](Options& options) { options.propagator = propagator; };
  };
  return {
      {"March", LeastElement, With(kMarch, 1500)},
      {"MarchAcrossBreaks", [] { return Broken(LeastElement()); }, With(kMarch, 1500)},
      {"MarchOnUnevenSteps", LeastElement, With(kMarch, 0, uneven)},
      {"MarchWithFewOutputTimes", LeastElement, With(kMarch, 1500, few_output_times)},
      {"MarchWithJumps", Diode, With(kMarch, 2000, [](Options& options) { options.project_initial_state = true; })},
      {"AbsoluteTolerance", Cancelling,
       With(kMarch, 1500,
            [](Options& options) {
              options.absolute_tolerances = {{{ComponentKind::kState, 2}, 1e-9}};
            })},
      {"ThetaScheme", LeastElement, With(kStep, 1500, [](Options& options) { options.theta = 0.5; })},
      {"Newton", [] { return Broken(LeastElement()); },
       With(kStep, 1500, [](Options& options) { options.step_solver = StepSolver::kNewton; })},
      {"SparseStepping", Heated, With(kStep, 1500, with_propagator(PropagatorKind::kSparseStepping))},
      {"IterativeStepping", Heated, With(kStep, 1500, with_propagator(PropagatorKind::kIterativeStepping))},
      {"Iteration", LeastElement, With(kIterate, 1500)},
      {"IterationAcrossBreaks", [] { return Broken(LeastElement()); }, With(kIterate, 1500)},
      {"IterationOnUnevenSteps", LeastElement, With(kIterate, 0, uneven)},
      {"IterationOnFixedWindows", LeastElement, With(kIterate, 1000, narrow)},
      {"AcceleratedIteration", LeastElement, With(kIterate, 1500, [](Options& options) { options.acceleration = 4; })},
      {"IterationInFlight", LeastElement,
       With(kIterate, 1500, [](Options& options) { options.windows_in_flight = 3; })},
      {"IterationByContours", LeastElement,
       With(kIterate, 1500, [](Options& options) { options.kernel = KernelSource::kContour; })},
      {"KroneckerMarch", Membrane, With(kMarch, 1000)},
      {"KroneckerIteration", Membrane, With(kIterate, 1000, narrow)},
      {"KroneckerMarchAcrossBreaks", [] { return Broken(Membrane()); }, With(kMarch, 1500)},
      {"KroneckerIterationAcrossBreaks", [] { return Broken(Membrane()); }, With(kIterate, 700, narrow)},
      {"ContourMarch", Heated, With(kMarch, 1500, with_propagator(PropagatorKind::kContour))},
      {"ContourIteration", Heated,
       With(kIterate, 1000,
            [&](Options& options) {
              narrow(options);
              options.propagator = PropagatorKind::kContour;
            })},
  };
}

INSTANTIATE_TEST_SUITE_P(All, CheckpointTest, ::testing::ValuesIn(Cases()),
                         [](const auto& tested) { return tested.param.name; });

TEST(ResumeTest, RefusesWhatIsNotOfThisSolve) {
  const Problem problem = LeastElement();
  const Options options = With(Method::kExponentialIntegrator, 1500);
  Taker taker(2);
  ASSERT_TRUE(Solve(problem, options, taker, taker.stop.get_token()).ok());
  ASSERT_EQ(taker.taken, 2u);
  const ResumePoint good = taker.point;
  const auto resume = [&](const ResumePoint& point, const Options& with) {
    Observer silent;
    return Solve(problem, with, silent, {}, nullptr, &point).status();
  };
  ASSERT_TRUE(resume(good, options).ok());
  EXPECT_EQ(resume(good, With(Method::kTimeStepping, 1500)).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(resume(good, With(Method::kExponentialIntegrator, 1501)).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(resume(good, With(Method::kWuChenIteration, 200)).code(), absl::StatusCode::kInvalidArgument);

  const ResumePoint without_trajectory{good.state, {}, {}, {}};
  EXPECT_EQ(resume(without_trajectory, options).code(), absl::StatusCode::kInvalidArgument);
  for (std::size_t k = 0; k < good.state.size(); k += 7) {
    ResumePoint changed = good;
    changed.state[k] ^= 1;
    EXPECT_EQ(resume(changed, options).code(), absl::StatusCode::kInvalidArgument) << k;
  }
  for (std::size_t size = 0; size < good.state.size(); size += 11) {
    ResumePoint cut = good;
    cut.state.resize(size);
    EXPECT_EQ(resume(cut, options).code(), absl::StatusCode::kInvalidArgument) << size;
  }
}

TEST(ResumeTest, LeavesNoCheckpointsWhereAnotherPassMayTakeOver) {
  const auto count = [](const Problem& problem, const Options& options) {
    Taker taker(0);
    EXPECT_TRUE(Solve(problem, options, taker, {}).ok());
    return taker.taken;
  };
  EXPECT_EQ(count(testing::FourVariableEasy(), With(Method::kExponentialIntegrator, 1500)), 0u);
  Options tolerance = With(Method::kExponentialIntegrator, 0);
  tolerance.error_tolerance = 1e-4;
  EXPECT_EQ(count(LeastElement(), tolerance), 0u);
}

}  // namespace
}  // namespace dlcs
