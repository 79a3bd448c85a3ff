// SPDX-License-Identifier: Apache-2.0
// The speed-up of the iteration and of output recovery with threads.
//
//     threads_bench [--quick] [Google Benchmark's flags]
//
// The iteration spends its time in LCPs (seconds_lcp), convolutions and the recovery of states
// (seconds_linear), and the kernel (seconds_setup). report.py computes the serial fraction from one and two
// threads, and from that a model of more.

#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/models/signorini.h"
#include "tests/bench/bench_support.h"
#include "tests/support/problems.h"

namespace dlcs::bench {
namespace {

struct Work {
  std::string name;
  Problem problem;
  Options options;
};

Work Iteration(const std::string& name, Problem problem, Index steps, bool all_states) {
  Work work{name, std::move(problem), {}};
  work.options.method = Method::kLaplaceIteration;
  work.options.num_steps = steps;
  work.options.output_times_only = !all_states;
  if (!all_states) work.options.output_times = {work.problem.horizon};
  return work;
}

std::vector<Work> Works(bool quick) {
  SignoriniModel model;
  model.cells = 40;
  const Problem signorini = *MakeSignoriniProblem(model);
  const Index steps = quick ? 400 : 1600;
  std::vector<Work> works = {
      Iteration("Signorini 1 by 40, last state", signorini, steps, false),
      Iteration("Signorini 1 by 40, all states", signorini, steps, true),
      Iteration("four variables, last state", testing::FourVariableEasy(), quick ? 20'000 : 200'000, false),
      Iteration("four variables, all states", testing::FourVariableEasy(), quick ? 20'000 : 200'000, true),
      Iteration("four variables, one window", testing::FourVariableEasy(), quick ? 20'000 : 200'000, false),
  };
  works.back().options.window_steps = Options::kWholeHorizon;
  return works;
}

void Run(benchmark::State& state, Work work, int threads, const Matrix& expected) {
  work.options.num_threads = threads;
  Cost sum;
  for (auto _ : state) {
    const std::optional<Solution> solution = SolveOrSkip(state, work.problem, work.options);
    if (!solution) return;
    if (solution->y != expected) return state.SkipWithError("other bits than on one thread");
    sum.seconds_setup += solution->cost.seconds_setup;
    sum.seconds_lcp += solution->cost.seconds_lcp;
    sum.seconds_linear += solution->cost.seconds_linear;
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["threads"] = threads;
  state.counters["seconds_setup"] = sum.seconds_setup / runs;
  state.counters["seconds_lcp"] = sum.seconds_lcp / runs;
  state.counters["seconds_linear"] = sum.seconds_linear / runs;
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  const std::vector<Work> works = Works(quick);
  std::vector<Matrix> serial(works.size());
  const auto processors = static_cast<int>(std::thread::hardware_concurrency());
  for (std::size_t k = 0; k < works.size(); ++k) {
    for (int threads = 1; threads <= processors; threads *= 2) {
      benchmark::RegisterBenchmark((works[k].name + "/" + std::to_string(threads)).c_str(),
                                   [&, k, threads](benchmark::State& state) {
                                     if (serial[k].size() == 0) {
                                       Options options = works[k].options;
                                       options.num_threads = 1;
                                       const std::optional<Solution> solution =
                                           SolveOrSkip(state, works[k].problem, options);
                                       if (!solution) return;
                                       serial[k] = solution->y;
                                     }
                                     Run(state, works[k], threads, serial[k]);
                                   })
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime()
          ->MinTime(quick ? 0.05 : 0.5)
          ->Repetitions(quick ? 3 : 7);
    }
  }
  return RunAll(argc, argv);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
