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
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/solve.h"
#include "tests/bench/bench_support.h"
#include "tests/bench/known_systems.h"

namespace dlcs::bench {
namespace {

// One way to solve, by its name and the parameters it is run with, from cheap to dear.
struct Way {
  std::string name;
  std::vector<Index> parameters;
  std::function<absl::StatusOr<Solution>(const KnownSystem& system, Index parameter)> solve;
  double residual = kResidualTolerance;  // that its certificate may have
  bool may_break_down = false;           // the mathematics has no answer for some steps, or for none
};

Way StepwiseWay(const std::string& name, Method method, bool averaged, const KnownSystem& system) {
  Way way{name, {}, [=](const KnownSystem& of, Index steps) {
            Observer silent;
            return Solve(of.problem, OptionsFor(of, method, averaged, steps), silent, {});
          }};
  for (Index steps = 16; steps <= system.most_steps; steps *= 2) way.parameters.push_back(steps);
  return way;
}

// With a contour that errs less than the steps: it costs the square of their number. One window: where the iterates
// diverge, the way does not serve.
constexpr Index kFewStates = 6;
Way PaperWay() {
  return {"wu-chen-iteration",
          {16, 32, 64, 128, 256, 512, 1024},
          [](const KnownSystem& of, Index steps) {
            Options options = OptionsFor(of, Method::kWuChenIteration, false, steps);
            options.num_contour_nodes = 100;
            options.iteration_tolerance = 1e-10;
            Observer silent;
            return Solve(of.problem, options, silent, {});
          },
          1e-6,
          true};
}

std::vector<Way> Ways(const KnownSystem& system) {
  std::vector<Way> ways = {StepwiseWay("implicit Euler", Method::kTimeStepping, false, system),
                           StepwiseWay("exponential-integrator", Method::kExponentialIntegrator, false, system)};
  ways.front().may_break_down = system.breaks_down;
  if (system.y_is_lipschitz) {
    if (system.has_few_states) ways.push_back(StepwiseWay("trapezoidal", Method::kTimeStepping, true, system));
    ways.push_back(StepwiseWay("laplace-iteration", Method::kLaplaceIteration, false, system));
    if (system.problem.num_states() <= kFewStates) ways.push_back(PaperWay());
  }
  if (system.has_few_states) {
    ways.push_back({"event-driven", {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, [](const KnownSystem& of, Index digits) {
                      return SolveByEvents(of, std::pow(10.0, -static_cast<double>(digits)));
                    }});
  }
  return ways;
}

// What the runs of one way on one problem know of those before: when to stop refining.
struct Progress {
  double seconds = 0;
  double error = 1;
};

void Run(benchmark::State& state, const KnownSystem& system, const Way& way, Index parameter, Progress& progress,
         double most_seconds) {
  if (progress.seconds > most_seconds / 2 || progress.error < 1e-11) return state.SkipWithError(kNotNeeded);
  absl::StatusOr<Solution> solution;
  const double start = ProcessorSeconds();
  for (auto _ : state) solution = way.solve(system, parameter);
  progress.seconds = (ProcessorSeconds() - start) / static_cast<double>(state.iterations());
  if (way.may_break_down && solution.ok() && solution->termination != Termination::kReachedEnd) {
    return state.SkipWithError(kNotNeeded);
  }
  const std::string wrong =
      solution.ok() ? WhatIsWrong(*solution, way.residual) : std::string(solution.status().message());
  if (!wrong.empty()) return state.SkipWithError(wrong.c_str());
  progress.error = TrueError(system, *solution);
  state.counters["error"] = progress.error;
  state.counters["uncertainty"] = system.uncertainty;
  state.counters["states"] = static_cast<double>(system.problem.num_states());
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  const std::vector<KnownSystem> systems = KnownSystems(quick);
  std::map<std::string, Progress> progress;
  for (const KnownSystem& system : systems) {
    for (const Way& way : Ways(system)) {
      const std::string name = system.name + "|" + way.name;
      Progress& of_way = progress[name];
      for (const Index parameter : way.parameters) {
        benchmark::RegisterBenchmark((name + "|" + std::to_string(parameter)).c_str(),
                                     [&system, way, parameter, &of_way, quick](benchmark::State& state) {
                                       Run(state, system, way, parameter, of_way, quick ? 0.2 : 3);
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
