// SPDX-License-Identifier: Apache-2.0
// The automatic choice of the method beside every explicit one, for the same error asked for, on one thread.
//
//     choice_bench [--quick] [Google Benchmark's flags]
//
// A line is SYSTEM|METHOD|DIGITS: a solve to the error 10^-DIGITS, or with 100 steps for 0 digits, its label the method
// that ran. best_ms is the least processor time of its runs; the true error is checked against the one asked for, for
// large sparse systems by the choice itself with a hundredth of it. report.py sets the choice against the best of the
// others.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/models/obstacle.h"
#include "core/models/signorini.h"
#include "core/solve.h"
#include "tests/bench/bench_support.h"
#include "tests/bench/known_systems.h"
#include "tests/support/sparse_problems.h"

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

// Large systems whose A is a sparse matrix without other structure.
struct SparseSystem {
  std::string name;
  Problem problem;
};

// Without its structure as a Kronecker sum.
Problem Sparse(Problem problem) {
  problem.A = StructuredMatrix(problem.A.Sparse());
  return problem;
}

std::vector<SparseSystem> SparseSystems(bool quick) {
  using testing::AdvectedGrid;
  std::vector<SparseSystem> systems = {
      {"line 2,000, 10 pairs", AdvectedGrid({.side = 2000, .dimensions = 1, .constraints = 10, .diffusion = 1e-3})},
      {"plane 40², 16 pairs, flow", AdvectedGrid({.side = 40, .constraints = 16, .speed = 8})},
      {"cube 10³, 100 pairs", AdvectedGrid({.side = 10, .dimensions = 3, .constraints = 100})},
      {"obstacle 40², 1,521 pairs",
       Sparse(MakeObstacleProblem({.cells = 40, .dimensions = 2, .horizon = 0.1}).value())}};
  if (quick) return systems;
  const std::vector<SparseSystem> large = {
      {"line 300,000, 10 pairs",
       AdvectedGrid({.side = 300'000, .dimensions = 1, .constraints = 10, .diffusion = 1e-8})},
      {"plane 150², 50 pairs", AdvectedGrid({.side = 150, .constraints = 50})},
      {"plane 100², 5,000 pairs, flow", AdvectedGrid({.side = 100, .constraints = 5000, .speed = 8})},
      {"cube 20³, 30 pairs, stiff, flow",
       AdvectedGrid({.side = 20, .dimensions = 3, .constraints = 30, .speed = 100, .diffusion = 5})},
      {"membrane 1/128, 127 pairs", Sparse(MakeSignoriniProblem({.cells = 128, .coefficient = 0.1}).value())},
      {"wall 24³, 529 pairs",
       Sparse(MakeSignoriniProblem({.cells = 24, .dimensions = 3, .coefficient = 0.1}).value())}};
  systems.insert(systems.end(), large.begin(), large.end());
  return systems;
}

struct SparseChoice {
  std::string name;
  Method method;
  PropagatorKind propagator;
  bool averaged = false;
};

// With steps that are given only methods of second order are compared, as the choice is one.
std::vector<SparseChoice> ChoicesFor(const SparseSystem& system, int digits) {
  constexpr Index kLargestDense = 2000;
  std::vector<SparseChoice> choices = {{"auto", Method::kAuto, PropagatorKind::kAuto},
                                       {"trapezoidal", Method::kTimeStepping, PropagatorKind::kSparseStepping, true},
                                       {"contour", Method::kExponentialIntegrator, PropagatorKind::kContour}};
  if (system.problem.M.IsZero()) choices.erase(choices.begin() + 1);  // averaging needs y to be a function of x
  if (digits > 0) choices.push_back({"implicit Euler", Method::kTimeStepping, PropagatorKind::kSparseStepping});
  if (system.problem.num_states() <= kLargestDense) {
    choices.push_back({"dense", Method::kExponentialIntegrator, PropagatorKind::kDense});
  }
  return choices;
}

// Solves until `most_s` seconds of wall time have passed.
absl::StatusOr<Solution> SolveWithin(double most_s, const Problem& problem, const Options& options) {
  std::stop_source stop;
  const std::jthread clock([&stop, most_s](const std::stop_token& done) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait_for(lock, done, std::chrono::duration<double>(most_s), [] { return false; });
    stop.request_stop();
  });
  Observer silent;
  return Solve(problem, options, silent, stop.get_token());
}

// What takes more than `most_s` seconds of wall time is left out, and what the method does not serve.
void Run(benchmark::State& state, const SparseSystem& system, const SparseChoice& choice, int digits, double most_s,
         std::map<std::string, Matrix>& references) {
  Options options;
  options.method = choice.method;
  options.propagator = choice.propagator;
  options.average_y = choice.averaged;
  options.num_threads = 1;
  options.estimate_error = false;
  options.output_times = {system.problem.horizon};
  options.output_times_only = true;
  if (digits == 0) options.num_steps = 100;
  if (digits > 0) options.error_tolerance = std::pow(10.0, -digits);
  absl::StatusOr<Solution> solution;
  double best = 1e9;
  for (auto _ : state) {
    const double begin = ProcessorSeconds();
    solution = SolveWithin(most_s, system.problem, options);
    best = std::min(best, ProcessorSeconds() - begin);
  }
  const auto ended = [&](Termination how) { return solution.ok() && solution->termination == how; };
  const bool is_served = choice.name == "auto" || !ended(Termination::kUnsupported);
  if (!is_served || ended(Termination::kCancelled)) return state.SkipWithError(kNotNeeded);
  const std::string wrong = solution.ok() ? WhatIsWrong(*solution) : std::string(solution.status().message());
  if (!wrong.empty()) return state.SkipWithError(wrong.c_str());
  if (digits > 0) {
    if (!references.contains(system.name)) {
      Options fine = options;
      fine.method = Method::kAuto;
      fine.propagator = PropagatorKind::kAuto;
      fine.average_y = false;
      fine.error_tolerance = 0.01 * options.error_tolerance;
      const auto known = SolveWithin(2 * most_s, system.problem, fine);
      const bool is_known = known.ok() && known->termination == Termination::kReachedEnd;
      references[system.name] = is_known ? known->x : Matrix();
    }
    const Matrix& reference = references[system.name];
    if (reference.size() > 0) {
      const double error = (solution->x - reference).cwiseAbs().maxCoeff() / reference.cwiseAbs().maxCoeff();
      if (!(error <= 1.1 * options.error_tolerance)) {
        const std::string times = std::to_string(error / options.error_tolerance);
        return state.SkipWithError(("the true error is " + times + " times the one asked for").c_str());
      }
      state.counters["error"] = error;
    }
  }
  state.counters["best_ms"] = 1e3 * best;
  state.SetLabel(choice.name == "auto" ? MethodName(solution->method) : choice.name);
}

void RegisterSparse(const std::vector<SparseSystem>& systems, bool quick, std::map<std::string, Matrix>& references) {
  for (const SparseSystem& system : systems) {
    for (const int digits : {0, 3}) {
      for (const SparseChoice& choice : ChoicesFor(system, digits)) {
        const auto run = [&system, choice, digits, quick, &references](benchmark::State& state) {
          Run(state, system, choice, digits, quick ? 5 : 20, references);
        };
        benchmark::RegisterBenchmark((system.name + "|" + choice.name + "|" + std::to_string(digits)).c_str(), run)
            ->Unit(benchmark::kMillisecond)
            ->Iterations(1);
      }
    }
  }
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
  const std::vector<SparseSystem> sparse = SparseSystems(quick);
  std::map<std::string, Matrix> references;
  RegisterSparse(sparse, quick, references);
  return RunAll(argc, argv);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
