// SPDX-License-Identifier: Apache-2.0
// Work and precision: the time of each method against the error that it leaves, on one thread.
//
//     work_precision_bench [--quick] [Google Benchmark's flags]
//
// A line is PROBLEM/METHOD/PARAMETER, with the number of steps or, for event location, the digits asked for
// as parameter. The error is the largest of x at the reference times, of each component relative to its
// largest value there. report.py reads off the cheapest run that meets an error, and what it costs by
// implicit Euler.

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "core/solve.h"
#include "tests/bench/bench_support.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs::bench {
namespace {

constexpr double kTightest = 1e-13;

struct Target {
  std::string name;
  Problem problem;
  std::vector<double> times;
  Matrix x;                // at these times
  double uncertainty = 0;  // of x, relative
  Index most_steps = 0;
  bool y_is_lipschitz = true;
  bool has_few_states = true;  // for the ways that take A as a dense matrix
};

// Each component relative to its largest value in `reference`.
double RelativeError(const Matrix& x, const Matrix& reference) {
  const Vector sizes = RowMaxAbs(reference).cwiseMax(std::numeric_limits<double>::min());
  return MaxAbs(sizes.cwiseInverse().asDiagonal() * (x - reference));
}

std::vector<double> EvenTimes(double horizon, Index count) {
  std::vector<double> times;
  for (Index k = 1; k <= count; ++k) times.push_back(horizon * static_cast<double>(k) / static_cast<double>(count));
  return times;
}

Options OutputAt(const std::vector<double>& times) {
  Options options;
  options.output_times = times;
  options.output_times_only = true;
  options.num_threads = 1;
  return options;
}

Options Stepping(const Target& target, Method method, bool averaged, Index steps) {
  Options options = OutputAt(target.times);
  options.method = method;
  options.average_y = averaged;
  options.theta = averaged ? 0.5 : 0;
  options.num_steps = steps;
  if (target.problem.A.kronecker_sum() != nullptr && method != Method::kTimeStepping) {
    options.realisation = Realisation::kKroneckerSum;
  }
  return options;
}

Matrix SolveByMarching(const Target& target, Method method, Index steps) {
  Observer silent;
  return Solve(target.problem, Stepping(target, method, false, steps), silent, {}).value().x;
}

absl::StatusOr<Solution> SolveEvents(const Target& target, double tolerance) {
  Options options = OutputAt(target.times);
  options.method = Method::kEventLocated;
  options.error_tolerance = tolerance;
  Observer silent;
  return Solve(target.problem, options, silent, {});
}

Target ExampleFourOne() {
  Target target{"example 4.1", testing::ExampleFourOne(), EvenTimes(1, 16), {}, 1e-15, Index{1} << 20};
  target.x.resize(2, 16);
  for (Index k = 0; k < 16; ++k) target.x.col(k) = testing::ExampleFourOneExact(target.times[k]);
  return target;
}

// By event location, with the distance of a fine march as its uncertainty.
Target FourVariables(bool quick) {
  Target target{"four variables", testing::FourVariableEasy(), EvenTimes(1, 16), {}, 0, Index{1} << 20};
  target.x = SolveEvents(target, kTightest).value().x;
  const Matrix marched = SolveByMarching(target, Method::kExponentialMarch, Index{1} << (quick ? 17 : 21));
  target.uncertainty = RelativeError(marched, target.x);
  return target;
}

// With the references of tests/cases, which another program made by another method.
Target FromCase(const std::string& name, bool y_is_lipschitz) {
  const testing::Case the_case = testing::LoadCase(name);
  Target target{name,          the_case.problem, testing::ReferenceTimes(the_case), {}, the_case.reference_accuracy,
                Index{1} << 19};
  target.y_is_lipschitz = y_is_lipschitz;
  target.x.resize(the_case.problem.num_states(), static_cast<Index>(target.times.size()));
  for (Index k = 0; k < target.x.cols(); ++k) target.x.col(k) = the_case.references[k].x;
  return target;
}

// By exp-PL on a grid finer than any that is measured, with the distance of the same on half of it as its uncertainty:
// the trapezoidal rule, which has 1521 states to step through, would take longer than all the rest.
Target Signorini(bool quick) {
  SignoriniModel model;
  model.cells = 40;
  Target target{"Signorini 1/40",      *MakeSignoriniProblem(model), EvenTimes(model.horizon, 16), {}, 0,
                1 << (quick ? 10 : 13)};
  target.has_few_states = false;
  target.x = SolveByMarching(target, Method::kExponentialMarch, 16 * target.most_steps);
  target.uncertainty =
      RelativeError(SolveByMarching(target, Method::kExponentialMarch, 8 * target.most_steps), target.x);
  return target;
}

std::vector<Target> Targets(bool quick) {
  std::vector<Target> targets = {ExampleFourOne(), FourVariables(quick)};
  for (const char* name : {"rlcd", "observer_lcs", "wall_permeable", "z_least"})
    targets.push_back(FromCase(name, true));
  for (const char* name : {"diode_bridge", "friction_oscillator"}) targets.push_back(FromCase(name, false));
  targets.push_back(Signorini(quick));
  return targets;
}

// One way to solve, by its name and the parameters it is run with, from cheap to dear.
struct Way {
  std::string name;
  std::vector<Index> parameters;
  std::function<absl::StatusOr<Solution>(const Target& target, Index parameter)> solve;
};

Way StepwiseWay(const std::string& name, Method method, bool averaged, const Target& target) {
  Way way{name, {}, [=](const Target& of, Index steps) {
            Observer silent;
            return Solve(of.problem, Stepping(of, method, averaged, steps), silent, {});
          }};
  for (Index steps = 16; steps <= target.most_steps; steps *= 2) way.parameters.push_back(steps);
  return way;
}

std::vector<Way> Ways(const Target& target) {
  std::vector<Way> ways = {StepwiseWay("implicit Euler", Method::kTimeStepping, false, target),
                           StepwiseWay("exponential-march", Method::kExponentialMarch, false, target)};
  if (target.y_is_lipschitz) {
    if (target.has_few_states) ways.push_back(StepwiseWay("trapezoidal", Method::kTimeStepping, true, target));
    ways.push_back(StepwiseWay("laplace-iteration", Method::kLaplaceIteration, false, target));
  }
  if (target.has_few_states) {
    ways.push_back({"event-located", {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, [](const Target& of, Index digits) {
                      return SolveEvents(of, std::pow(10.0, -static_cast<double>(digits)));
                    }});
  }
  return ways;
}

// What the runs of one way on one problem know of those before: when to stop refining.
struct Progress {
  double seconds = 0;
  double error = 1;
};

void Run(benchmark::State& state, const Target& target, const Way& way, Index parameter, Progress& progress,
         double most_seconds) {
  if (progress.seconds > most_seconds / 2 || progress.error < 1e-11) return state.SkipWithError(kNotNeeded);
  absl::StatusOr<Solution> solution;
  const std::clock_t start = std::clock();
  for (auto _ : state) solution = way.solve(target, parameter);
  progress.seconds =
      static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / static_cast<double>(state.iterations());
  const std::string wrong = solution.ok() ? WhatIsWrong(*solution) : std::string(solution.status().message());
  if (!wrong.empty()) return state.SkipWithError(wrong.c_str());
  progress.error = RelativeError(solution->x, target.x);
  state.counters["error"] = progress.error;
  state.counters["uncertainty"] = target.uncertainty;
  state.counters["states"] = static_cast<double>(target.problem.num_states());
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  const std::vector<Target> targets = Targets(quick);
  std::map<std::string, Progress> progress;
  for (const Target& target : targets) {
    for (const Way& way : Ways(target)) {
      const std::string name = target.name + "|" + way.name;
      Progress& of_way = progress[name];
      for (const Index parameter : way.parameters) {
        benchmark::RegisterBenchmark((name + "|" + std::to_string(parameter)).c_str(),
                                     [&target, way, parameter, &of_way, quick](benchmark::State& state) {
                                       Run(state, target, way, parameter, of_way, quick ? 0.2 : 3);
                                     })
            ->Unit(benchmark::kMillisecond)
            ->MinTime(quick ? 0.005 : 0.05);
      }
    }
  }
  return RunAll(argc, argv);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
