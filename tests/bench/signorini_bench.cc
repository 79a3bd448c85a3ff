// SPDX-License-Identifier: Apache-2.0
// The parabolic Signorini problem of [Wu & Chen], section 4.2 (core/models/signorini.h), T = 4, on one thread: every
// method of the engine beside implicit Euler done well for it (signorini_euler.h) and the iteration as the paper prints
// it.
//
//     signorini_bench [--quick] [--cells=16,40,...] [--steps=400,...] [Google Benchmark's flags]
//
// A line is WAY|CELLS|STEPS|COEFFICIENT; total_ms is processor time, set-up included, the best of the runs; the split
// of the time is that of the paper's Table 4.1, `rounds` its iterations. --cells are the meshes, with the first of
// --steps; the other --steps go with the mesh 1/40. `extrapolated` counts the steps, or the states, from which a time
// was extrapolated. What took seconds on one mesh is left out on the next; --quick extrapolates implicit Euler by
// Cholesky from 128 cells on, and leaves out more.
//
// Checks: the engine's answers have their certificates; the march and the iteration agree on y(T), the iteration to
// what (4.8) of [Wu & Chen] leaves; all forms of implicit Euler agree to 1e-9, and with the march to its first order;
// event location agrees with the march to the march's error; the printed iterate with its exact integrals.

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "core/solve.h"
#include "fmt/format.h"
#include "tests/bench/bench_support.h"
#include "tests/bench/signorini_contour.h"
#include "tests/bench/signorini_euler.h"

namespace dlcs::bench {
namespace {

constexpr double kLong_s = 4;
constexpr Index kCellsOfGoals = 256;

struct Setting {
  Index cells = 0;
  Index steps = 0;
  double coefficient = 0;
  bool quick = false;

  bool operator<(const Setting& other) const {
    return std::tie(cells, steps, coefficient) < std::tie(other.cells, other.steps, other.coefficient);
  }
};

Problem ProblemOf(const Setting& setting) {
  SignoriniModel model;
  model.coefficient = setting.coefficient;
  model.cells = setting.cells;
  return MakeSignoriniProblem(model).value();
}

// (4.8) of the paper.
double ToleranceOf(const Setting& setting, double horizon) {
  const auto cells = static_cast<double>(setting.cells), steps = static_cast<double>(setting.steps);
  return std::min(horizon / steps, 1 / (cells * cells)) / 10;
}

Options OptionsFor(const Setting& setting, const Problem& problem, Method method) {
  Options options;
  options.method = method;
  options.num_steps = setting.steps;
  options.estimate_error = false;
  options.num_threads = 1;
  options.output_times = {problem.horizon};
  options.output_times_only = true;
  return options;
}

// y(T) of the march, and all y of implicit Euler, made once for each setting.
struct Reference {
  Vector y_end;
  Matrix euler_y;
};
const Reference& ReferenceOf(const Setting& setting) {
  static std::map<Setting, Reference> kept;
  Reference& reference = kept[setting];
  if (reference.y_end.size() > 0) return reference;
  const Problem problem = ProblemOf(setting);
  Observer silent;
  const auto march = Solve(problem, OptionsFor(setting, problem, Method::kExponentialIntegrator), silent, {});
  if (!march.ok() || !WhatIsWrong(*march).empty()) throw std::runtime_error("the march does not serve as a reference");
  SineEuler euler(problem, setting.steps);
  euler.Run();
  reference = {march->y.rightCols(1), euler.y()};
  return reference;
}

// Fails NaN, too.
void ExpectAtMost(benchmark::State& state, double error, double most, const char* what) {
  state.counters["difference"] = error;
  if (!(error <= most)) state.SkipWithError(what);
}

// One way to solve the problem, where it serves. `run` checks the answer and returns how many seconds a run took.
struct Way {
  std::string name;
  std::function<bool(const Setting& setting)> serves;
  std::function<double(benchmark::State& state, const Setting& setting)> run;
};

// Solves by the engine, and tells the shares of the quickest run.
double RunEngine(benchmark::State& state, const Problem& problem, const Options& options,
                 const std::function<void(const Solution& solution)>& check) {
  std::optional<Solution> best;
  double total = 1e9;
  for (auto _ : state) {
    Observer observer;
    const double begin = ProcessorSeconds();
    auto solution = Solve(problem, options, observer, {});
    const double seconds = ProcessorSeconds() - begin;
    if (!solution.ok() || solution->termination != Termination::kReachedEnd) {
      state.SkipWithError(solution.ok() ? solution->message.c_str() : "refused");
      return seconds;
    }
    if (seconds < total) best = *std::move(solution);
    total = std::min(total, seconds);
  }
  check(*best);
  const Cost& cost = best->cost;
  // A clock of the wall made them, which other programs lengthen; shares of its whole are right all the same.
  const auto milliseconds = [&](double part) { return 1e3 * total * part / std::max(cost.seconds_total, 1e-9); };
  state.counters["rounds"] = static_cast<double>(cost.iterations);
  state.counters["setup_ms"] = milliseconds(cost.seconds_setup);
  state.counters["lcp_ms"] = milliseconds(cost.seconds_lcp);
  state.counters["linear_ms"] = milliseconds(cost.seconds_linear);
  state.counters["certificate_ms"] = milliseconds(cost.seconds_certificate);
  state.counters["total_ms"] = 1e3 * total;
  return total;
}

double RunMarch(benchmark::State& state, const Setting& setting) {
  const Problem problem = ProblemOf(setting);
  return RunEngine(state, problem, OptionsFor(setting, problem, Method::kExponentialIntegrator),
                   [&](const Solution& solution) {
                     ExpectAtMost(state, MaxAbs(solution.y.rightCols(1) - ReferenceOf(setting).y_end), 1e-9,
                                  "differs from the march");
                     if (!WhatIsWrong(solution).empty()) state.SkipWithError("its certificate fails");
                   });
}

struct IterationForm {
  Index window_steps = 0;
  int windows_in_flight = 1;
  int acceleration = 0;
};

double RunIteration(benchmark::State& state, const Setting& setting, const IterationForm& form) {
  const Problem problem = ProblemOf(setting);
  Options options = OptionsFor(setting, problem, Method::kLaplaceIteration);
  options.window_steps = form.window_steps;
  options.windows_in_flight = form.windows_in_flight;
  options.acceleration = form.acceleration;
  options.iteration_tolerance = ToleranceOf(setting, problem.horizon);
  return RunEngine(state, problem, options, [&](const Solution& solution) {
    ExpectAtMost(state, MaxAbs(solution.y.rightCols(1) - ReferenceOf(setting).y_end), 100 * options.iteration_tolerance,
                 "differs from the march");
  });
}

// Implicit Euler by the engine: A sparse, a factor of I - hA.
double RunTimeStepping(benchmark::State& state, const Setting& setting) {
  const Problem problem = ProblemOf(setting);
  Options options = OptionsFor(setting, problem, Method::kTimeStepping);
  options.propagator = PropagatorKind::kSparseStepping;
  return RunEngine(state, problem, options, [&](const Solution& solution) {
    ExpectAtMost(state, MaxAbs(solution.y.rightCols(1) - ReferenceOf(setting).euler_y.rightCols(1)), 1e-9,
                 "differs from implicit Euler by sine transforms");
    if (!WhatIsWrong(solution).empty()) state.SkipWithError("its certificate fails");
  });
}

double RunEvents(benchmark::State& state, const Setting& setting) {
  const Problem problem = ProblemOf(setting);
  Options options = OptionsFor(setting, problem, Method::kEventDriven);
  options.error_tolerance = 1e-4;
  return RunEngine(state, problem, options, [&](const Solution& solution) {
    constexpr double kErrorOfMarch = 5e-3;
    ExpectAtMost(state, MaxAbs(solution.y.rightCols(1) - ReferenceOf(setting).y_end), kErrorOfMarch,
                 "far from the march");
  });
}

double RunSine(benchmark::State& state, const Setting& setting) {
  const Problem problem = ProblemOf(setting);
  const Reference& reference = ReferenceOf(setting);
  double setup = 1e9, total = 1e9;
  Vector y_end;
  for (auto _ : state) {
    const double begin = ProcessorSeconds();
    SineEuler euler(problem, setting.steps);
    setup = std::min(setup, ProcessorSeconds() - begin);
    euler.Run();
    total = std::min(total, ProcessorSeconds() - begin);
    y_end = euler.y().rightCols(1);
  }
  const double first_order = 4.0 / static_cast<double>(setting.steps);
  ExpectAtMost(state, MaxAbs(y_end - reference.y_end), first_order, "far from the march");
  state.counters["setup_ms"] = 1e3 * setup;
  state.counters["total_ms"] = 1e3 * total;
  return total;
}

// With --quick the first steps only, on the finer meshes, and the time extrapolated.
double RunCholesky(benchmark::State& state, const Setting& setting) {
  const Problem problem = ProblemOf(setting);
  const Reference& reference = ReferenceOf(setting);
  const bool extrapolates = setting.quick && setting.cells >= 128;
  const Index steps = extrapolates ? std::min<Index>(20, setting.steps) : setting.steps;
  double setup = 1e9, marching = 1e9, error = 0;
  for (auto _ : state) {
    const double begin = ProcessorSeconds();
    CholeskyEuler euler(problem, setting.steps);
    const double marched = ProcessorSeconds();
    setup = std::min(setup, marched - begin);
    euler.Run(steps);
    marching = std::min(
        marching, (ProcessorSeconds() - marched) * static_cast<double>(setting.steps) / static_cast<double>(steps));
    error = MaxAbs(euler.y().middleCols(1, steps) - reference.euler_y.middleCols(1, steps));
  }
  ExpectAtMost(state, error, 1e-9, "the two forms of implicit Euler differ");
  state.counters["setup_ms"] = 1e3 * setup;
  state.counters["total_ms"] = 1e3 * (setup + marching);
  if (extrapolates) state.counters["extrapolated"] = static_cast<double>(steps);
  return setup + marching * static_cast<double>(steps) / static_cast<double>(setting.steps);
}

// The iteration as printed: a few of the J states of one iterate, times J, times the iterations that the whole-window
// iteration takes to (4.8). Its LCPs are left out.
double RunPrinted(benchmark::State& state, const Setting& setting) {
  const Problem problem = ProblemOf(setting);
  const Index states = setting.quick ? 4 : 16;
  Options options = OptionsFor(setting, problem, Method::kLaplaceIteration);
  options.window_steps = Options::kWholeHorizon;
  options.iteration_tolerance = ToleranceOf(setting, problem.horizon);
  const std::optional<Solution> converged = SolveOrSkip(state, problem, options, 10 * options.iteration_tolerance);
  if (!converged) return 0;
  const Matrix input = ReferenceOf(setting).euler_y + SampleObstacle(problem, setting.steps);
  const PrintedIterate iterate(problem, input);
  double a_state = 1e9;
  Matrix x;
  for (auto _ : state) {
    const double begin = ProcessorSeconds();
    for (Index k = 0; k < states; ++k) {
      x = iterate.State(setting.steps * (2 * k + 1) / (2 * states));
    }
    a_state = std::min(a_state, (ProcessorSeconds() - begin) / static_cast<double>(states));
  }
  // 25 nodes do not resolve what fine meshes hold at the end of the inner integral.
  const double stiffness = setting.coefficient * problem.horizon * static_cast<double>(setting.cells * setting.cells);
  const Index last = setting.steps * (2 * states - 1) / (2 * states);
  ExpectAtMost(state, MaxAbs(x - iterate.ExactState(last)), 1e-4 * std::max(1.0, stiffness),
               "the contour's integrals are not the exact ones");
  const auto iterations = static_cast<double>(converged->cost.iterations);
  const double total = a_state * iterations * static_cast<double>(setting.steps);
  state.counters["rounds"] = iterations;
  state.counters["total_ms"] = 1e3 * total;
  state.counters["extrapolated"] = static_cast<double>(states);
  return a_state * static_cast<double>(states);
}

std::vector<Way> Ways() {
  const auto always = [](const Setting&) { return true; };
  constexpr Index kMaxCellsOfModes = 16;  // event location takes Schur forms of A
  const auto iteration = [&](const char* name, const IterationForm& form) {
    return Way{name, always,
               [form](auto& state, const Setting& setting) { return RunIteration(state, setting, form); }};
  };
  return {
      {"march", always, RunMarch},
      iteration("iteration, whole window", {.window_steps = Options::kWholeHorizon}),
      iteration("iteration, whole window, Anderson", {.window_steps = Options::kWholeHorizon, .acceleration = 2}),
      iteration("iteration, windows", {}),
      iteration("iteration, windows of 8, 4 in flight", {.window_steps = 8, .windows_in_flight = 4}),
      {"iteration as printed", always, RunPrinted},
      {"event location", [](const Setting& setting) { return setting.cells <= kMaxCellsOfModes; }, RunEvents},
      {"time-stepping", always, RunTimeStepping},
      {"implicit Euler, sine transform", always, RunSine},
      {"implicit Euler, sparse Cholesky", always, RunCholesky},
  };
}

// The numbers after `flag` among the arguments, which are left without it.
std::vector<Index> NumbersOf(int& argc, char** argv, const std::string& flag, std::vector<Index> otherwise) {
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    if (text.rfind(flag, 0) != 0) continue;
    TakeFlag(argc, argv, text);
    std::vector<Index> numbers;
    std::istringstream list(text.substr(flag.size()));
    for (std::string number; std::getline(list, number, ',');) numbers.push_back(std::stol(number));
    return numbers;
  }
  return otherwise;
}

std::vector<Setting> SettingsOf(const std::vector<Index>& cells, const std::vector<Index>& steps, bool quick) {
  constexpr Index kMeshOfSteps = 40;
  std::vector<Setting> settings;
  for (const double coefficient : {2e-4, 2e-2}) {
    for (const Index of : cells) settings.push_back({of, steps.front(), coefficient, quick});
    for (std::size_t k = 1; k < steps.size(); ++k) settings.push_back({kMeshOfSteps, steps[k], coefficient, quick});
  }
  return settings;
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  std::vector<Index> meshes = {16, 40, 64, 128, 256};
  if (!quick) meshes.push_back(512);
  const std::vector<Index> cells = NumbersOf(argc, argv, "--cells=", meshes);
  const std::vector<Index> steps = NumbersOf(argc, argv, "--steps=", {400});
  std::map<std::string, double> last;  // how long a way took, on the mesh before
  for (const Setting& setting : SettingsOf(cells, steps, quick)) {
    for (const Way& way : Ways()) {
      if (!way.serves(setting)) continue;
      double& before = last[fmt::format("{} {:g} {}", way.name, setting.coefficient, setting.steps)];
      const auto run = [&before, way, setting](benchmark::State& state) {
        if (before > (setting.quick ? kLong_s / 4 : 8 * kLong_s)) return state.SkipWithError(kNotNeeded);
        try {
          before = way.run(state, setting);
        } catch (const std::runtime_error& error) {
          state.SkipWithError(error.what());
        }
      };
      const std::string name =
          fmt::format("{}|{}|{}|{:g}", way.name, setting.cells, setting.steps, setting.coefficient);
      benchmark::RegisterBenchmark(name.c_str(), run)
          ->Unit(benchmark::kMillisecond)
          ->MinTime(!quick                           ? 0.5
                    : setting.cells == kCellsOfGoals ? 0.3
                                                     : 0.05);
    }
  }
  return RunAll(argc, argv);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
