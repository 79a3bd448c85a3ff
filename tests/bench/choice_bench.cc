// SPDX-License-Identifier: Apache-2.0
// The automatic choice of the method beside every explicit one, for the same error asked for, on one thread.
//
//     choice_bench [--quick] [Google Benchmark's flags]
//
// A line is SYSTEM|METHOD|DIGITS: a solve to the error 10^-DIGITS, its label the method that ran. best_ms is the least
// processor time of its runs; the true error is checked against the one asked for. report.py sets the choice against
// the best of the others.

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/solve.h"
#include "tests/bench/bench_support.h"
#include "tests/bench/known_systems.h"

namespace dlcs::bench {
namespace {

struct Choice {
  std::string name;
  Method method;
  bool averaged = false;
};

std::vector<Choice> ChoicesFor(const KnownSystem& system) {
  std::vector<Choice> choices = {{"auto", Method::kAuto},
                                 {"exponential-integrator", Method::kExponentialIntegrator},
                                 {"time-stepping", Method::kTimeStepping}};
  if (system.y_is_lipschitz) {
    choices.push_back({"trapezoidal", Method::kTimeStepping, true});
    choices.push_back({"laplace-iteration", Method::kLaplaceIteration});
  }
  if (system.has_few_states) choices.push_back({"event-driven", Method::kEventDriven});
  return choices;
}

// What the last solve to a larger error took.
struct Last {
  int digits = 0;
  double seconds = 0;
};

// Steps grow tenfold with each digit for a method of first order, and by √10 for one of second; event location hardly
// knows.
double Predicted(const KnownSystem& system, const Choice& choice, const Last& last, int digits) {
  const bool is_second = system.y_is_lipschitz && (choice.averaged || choice.method != Method::kTimeStepping);
  const double order = choice.method == Method::kEventDriven || choice.method == Method::kAuto ? 8 : is_second ? 2 : 1;
  return last.seconds * std::pow(10, (digits - last.digits) / order);
}

// What would take longer than `most_s` is left out.
void Run(benchmark::State& state, const KnownSystem& system, const Choice& choice, int digits, Last& last,
         double most_s) {
  if (Predicted(system, choice, last, digits) > most_s) return state.SkipWithError(kNotNeeded);
  Options options = OptionsFor(system, choice.method, choice.averaged, 0);
  options.error_tolerance = std::pow(10.0, -digits);
  absl::StatusOr<Solution> solution;
  double best = 1e9;
  for (auto _ : state) {
    Observer silent;
    const double begin = ProcessorSeconds();
    solution = Solve(system.problem, options, silent, {});
    best = std::min(best, ProcessorSeconds() - begin);
  }
  last = {digits, best};
  const std::string wrong = solution.ok() ? WhatIsWrong(*solution) : std::string(solution.status().message());
  if (!wrong.empty()) return state.SkipWithError(wrong.c_str());
  const double error = TrueError(system, *solution);
  if (!(error <= options.error_tolerance + 2 * system.uncertainty)) {
    return state.SkipWithError(
        ("the true error is " + std::to_string(error / options.error_tolerance) + " times the one asked for").c_str());
  }
  state.counters["error"] = error;
  state.counters["best_ms"] = 1e3 * best;
  state.SetLabel(MethodName(solution->method));
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  const std::vector<KnownSystem> systems = KnownSystems(quick);
  const std::vector<int> all_digits = quick ? std::vector<int>{2, 4, 6, 8} : std::vector<int>{2, 3, 4, 5, 6, 7, 8, 9};
  std::map<std::string, Last> all_last;
  for (const KnownSystem& system : systems) {
    for (const int digits : all_digits) {
      if (std::pow(10.0, -digits) < 3 * system.uncertainty) continue;
      for (const Choice& choice : ChoicesFor(system)) {
        const std::string name = system.name + "|" + choice.name;
        Last& last = all_last[name];
        const auto run = [&system, choice, digits, &last, quick](benchmark::State& state) {
          Run(state, system, choice, digits, last, quick ? 0.5 : 3);
        };
        benchmark::RegisterBenchmark((name + "|" + std::to_string(digits)).c_str(), run)
            ->Unit(benchmark::kMillisecond)
            ->MinTime(quick ? 0.01 : 0.1);
      }
    }
  }
  return RunAll(argc, argv);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
