// SPDX-License-Identifier: Apache-2.0
// The parabolic Signorini problem of [Wu & Chen], section 4.2, over T = 4: the iteration with the whole horizon as one
// window, the march, and implicit Euler.
//
//     signorini_bench [--quick] [--cells=16,32,...] [Google Benchmark's flags]
//
// A line is WHAT|METHOD|CELLS|STEPS|COEFFICIENT, with WHAT = "cells" or "steps", whichever varies. The iteration stops
// at (4.8) of the paper, min(h, Δx²)/10; its split of the time is the paper's Table 4.1.

#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/models/signorini.h"
#include "fmt/format.h"
#include "tests/bench/bench_support.h"

namespace dlcs::bench {
namespace {

struct Setting {
  std::string what;
  std::string name;
  Method method;
  Index cells;
  Index steps;
  double coefficient;
};

Options OptionsFor(const Setting& setting, double horizon) {
  Options options;
  options.method = setting.method;
  options.num_steps = setting.steps;
  options.num_threads = 1;
  options.realisation =
      setting.method == Method::kTimeStepping ? Realisation::kSparseStepping : Realisation::kKroneckerSum;
  // The boundary is what the figures show; states are wanted at the end only.
  options.output_times_only = true;
  options.output_times = {horizon};
  if (setting.method == Method::kLaplaceIteration) {
    options.window_steps = Options::kWholeHorizon;
    const double cells = static_cast<double>(setting.cells), steps = static_cast<double>(setting.steps);
    options.tolerance = std::min(horizon / steps, 1 / (cells * cells)) / 10;
  }
  return options;
}

// How long, in processor time, the last solve of each kind took: the next, larger one is left out where that was long already.
using Durations = std::map<std::string, double>;
constexpr double kLong_s = 4;

void Run(benchmark::State& state, const Setting& setting, Durations& durations) {
  double& last = durations[fmt::format("{} {} {:g}", setting.what, setting.name, setting.coefficient)];
  if (last > kLong_s) return state.SkipWithError(kNotNeeded);
  SignoriniModel model;
  model.cells = setting.cells;
  model.coefficient = setting.coefficient;
  const Problem problem = MakeSignoriniProblem(model).value();
  const Options options = OptionsFor(setting, problem.horizon);
  // What is left of the iteration when it stops is left in its LCPs too.
  const double residual = setting.method == Method::kLaplaceIteration ? 10 * options.tolerance : kResidualTolerance;
  const std::clock_t start = std::clock();
  std::optional<Solution> solution;
  for (auto _ : state) {
    solution = SolveOrSkip(state, problem, options, residual);
    if (!solution) return;
  }
  last = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / static_cast<double>(state.iterations());
  const Cost& cost = solution->cost;
  state.counters["iterations"] = static_cast<double>(cost.iterations);
  state.counters["share_lcp"] = cost.seconds_lcp / cost.seconds_total;
  state.counters["share_linear"] = cost.seconds_linear / cost.seconds_total;
  state.counters["share_setup"] = cost.seconds_setup / cost.seconds_total;
}

std::vector<Index> CellsOf(int& argc, char** argv, bool quick) {
  const std::string flag = "--cells=";
  for (int i = 1; i < argc; ++i) {
    std::string text = argv[i];
    if (text.rfind(flag, 0) != 0) continue;
    TakeFlag(argc, argv, text);
    std::vector<Index> cells;
    for (text.erase(0, flag.size()); !text.empty(); text.erase(0, std::min(text.size(), text.find(',')) + 1)) {
      cells.push_back(std::stol(text));
      if (text.find(',') == std::string::npos) break;
    }
    return cells;
  }
  return quick ? std::vector<Index>{16, 32, 40, 64} : std::vector<Index>{16, 32, 40, 64, 128, 256};
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  const std::vector<Index> all_cells = CellsOf(argc, argv, quick);
  const Index fixed_cells = std::min<Index>(40, all_cells.back());
  constexpr Index kSteps = 400;
  std::vector<Setting> settings;
  for (const double coefficient : {2e-4, 2e-2}) {
    if (quick && coefficient > 1e-3) continue;
    const auto add = [&](const char* what, Index cells, Index steps) {
      settings.push_back({what, "iteration", Method::kLaplaceIteration, cells, steps, coefficient});
      settings.push_back({what, "march", Method::kExponentialMarch, cells, steps, coefficient});
      settings.push_back({what, "implicit Euler", Method::kTimeStepping, cells, steps, coefficient});
    };
    for (const Index cells : all_cells) add("cells", cells, kSteps);
    for (const Index steps : {100, 200, 400, 800, 1600, 3200}) add("steps", fixed_cells, steps);
  }
  Durations durations;
  for (const Setting& setting : settings) {
    benchmark::RegisterBenchmark(
        fmt::format("{}|{}|{}|{}|{:g}", setting.what, setting.name, setting.cells, setting.steps, setting.coefficient)
            .c_str(),
        [&](benchmark::State& state) { Run(state, setting, durations); })
        ->Unit(benchmark::kMillisecond)
        ->MinTime(quick ? 0.02 : 0.2);
  }
  return RunAll(argc, argv);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
