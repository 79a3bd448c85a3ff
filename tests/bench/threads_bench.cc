// SPDX-License-Identifier: Apache-2.0
// The speed-up of the iteration, of the recovery of states, and of ensembles with threads.
//
//     threads_bench [--quick] [Google Benchmark's flags]
//
// The iteration spends its time in LCPs (seconds_lcp), convolutions and the recovery of states (seconds_linear), and
// the kernel (seconds_setup); "all states" beside "last state" is what the recovery costs. "independent sums" is
// arithmetic that shares nothing: what the machine has to give. A run of its own measures how much of one thread's time
// lies in parallel loops, and models more processors from that (parallel_meter.h).

#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/ensemble.h"
#include "core/models/signorini.h"
#include "core/parallel/parallel.h"
#include "tests/bench/bench_support.h"
#include "tests/bench/parallel_meter.h"
#include "tests/support/problems.h"

namespace dlcs::bench {
namespace {

struct Answer {
  std::vector<Matrix> y;
  Cost cost;  // of all solves
};

// `solve` marks the state as failed where an answer does not count, and returns nothing.
struct Work {
  std::string name;
  std::function<std::optional<Answer>(benchmark::State& state, int threads)> solve;
};

Work Iteration(const std::string& name, Problem problem, Index steps, bool all_states, bool one_window = false) {
  Options options;
  options.method = Method::kLaplaceIteration;
  options.num_steps = steps;
  options.estimate_error = false;
  options.output_times_only = !all_states;
  if (!all_states) options.output_times = {problem.horizon};
  if (one_window) options.window_steps = Options::kWholeHorizon;
  return {name, [problem = std::move(problem), options](benchmark::State& state, int threads) -> std::optional<Answer> {
            Options on_threads = options;
            on_threads.num_threads = threads;
            std::optional<Solution> solution = SolveOrSkip(state, problem, on_threads);
            if (!solution) return std::nullopt;
            return Answer{{std::move(solution->y)}, solution->cost};
          }};
}

// Members that differ in x0, by up to a tenth: the kernel is shared.
Work Ensemble(const std::string& name, Problem problem, Index steps, Index count) {
  std::vector<EnsembleMember> members(static_cast<std::size_t>(count));
  for (Index k = 0; k < count; ++k) {
    members[static_cast<std::size_t>(k)].x0 =
        problem.x0 * (1 - 0.1 * static_cast<double>(k) / static_cast<double>(count));
  }
  Options options;
  options.method = Method::kExponentialIntegrator;
  options.num_steps = steps;
  options.estimate_error = false;
  return {
      name,
      [problem = std::move(problem), options, members](benchmark::State& state, int threads) -> std::optional<Answer> {
        Options on_threads = options;
        on_threads.num_threads = threads;
        Answer answer;
        answer.y.resize(members.size());
        std::string wrong;
        const absl::Status status = SolveEnsemble(problem, members, on_threads,
                                                  [&](Index member, Solution solution) {
                                                    if (wrong.empty()) wrong = WhatIsWrong(solution);
                                                    answer.y[static_cast<std::size_t>(member)] = std::move(solution.y);
                                                    answer.cost.seconds_setup += solution.cost.seconds_setup;
                                                    answer.cost.seconds_lcp += solution.cost.seconds_lcp;
                                                    answer.cost.seconds_linear += solution.cost.seconds_linear;
                                                  },
                                                  {});
        if (!status.ok()) wrong = std::string(status.message());
        if (wrong.empty()) return answer;
        state.SkipWithError(wrong.c_str());
        return std::nullopt;
      }};
}

// Two recurrences that depend on nothing but themselves.
Work IndependentSums() {
  return {"independent sums", [](benchmark::State&, int threads) -> std::optional<Answer> {
            Matrix sums = Matrix::Constant(1, 2, 0.5);
            Workers workers(threads);
            workers.ForBlocks(2, 1, [&](Index k, Index, Index) {
              double x = sums(0, k);
              for (int i = 0; i < 10'000'000; ++i) x = 3.7 * x * (1 - x);
              sums(0, k) = x;
            });
            return Answer{{sums}, {}};
          }};
}

std::vector<Work> Works(bool quick) {
  SignoriniModel model;
  model.cells = 40;
  const Problem signorini = *MakeSignoriniProblem(model);
  const Problem four = testing::FourVariableEasy();
  const Index steps = quick ? 400 : 1600, many_steps = quick ? 20'000 : 200'000;
  return {
      IndependentSums(),
      Iteration("iteration, Signorini 1 by 40, last state", signorini, steps, false),
      Iteration("iteration, Signorini 1 by 40, all states", signorini, steps, true),
      Iteration("iteration, four variables, last state", four, many_steps, false),
      Iteration("iteration, four variables, all states", four, many_steps, true),
      Iteration("iteration, four variables, one window", four, many_steps, false, true),
      Ensemble("ensemble of 256, four variables, J = 400", four, 400, 256),
      Ensemble("ensemble of 16, Signorini 1 by 40, all states", signorini, 400, 16),
  };
}

void Run(benchmark::State& state, const Work& work, int threads, const Answer& expected) {
  Cost sum;
  for (auto _ : state) {
    const std::optional<Answer> answer = work.solve(state, threads);
    if (!answer) return;
    if (answer->y != expected.y) return state.SkipWithError("other bits than on one thread");
    sum.seconds_setup += answer->cost.seconds_setup;
    sum.seconds_lcp += answer->cost.seconds_lcp;
    sum.seconds_linear += answer->cost.seconds_linear;
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["threads"] = threads;
  state.counters["seconds_setup"] = sum.seconds_setup / runs;
  state.counters["seconds_lcp"] = sum.seconds_lcp / runs;
  state.counters["seconds_linear"] = sum.seconds_linear / runs;
}

// One thread's answer, which all others must have bit by bit, and its share of parallel loops.
struct Serial {
  Answer answer;
  ParallelShare share;
};

std::optional<Serial> SolveSerially(benchmark::State& state, const Work& work) {
  StartParallelMeter();
  std::optional<Answer> answer = work.solve(state, 1);
  const ParallelShare share = StopParallelMeter();
  if (!answer) return std::nullopt;
  return Serial{*std::move(answer), share};
}

void Tell(benchmark::State& state, const ParallelShare& share) {
  state.counters["serial_fraction"] = 1 - share.inside_s / share.total_s;
  for (std::size_t k = 0; k < kModeledProcessors.size(); ++k) {
    state.counters["model_" + std::to_string(kModeledProcessors[k])] = share.total_s / share.on_processors_s[k];
  }
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  const std::vector<Work> works = Works(quick);
  std::vector<std::optional<Serial>> serial(works.size());
  const auto processors = static_cast<int>(std::thread::hardware_concurrency());
  for (std::size_t k = 0; k < works.size(); ++k) {
    for (int threads = 1; threads <= processors; threads *= 2) {
      benchmark::RegisterBenchmark((works[k].name + "/" + std::to_string(threads)).c_str(),
                                   [&, k, threads](benchmark::State& state) {
                                     if (!serial[k]) serial[k] = SolveSerially(state, works[k]);
                                     if (!serial[k]) return;
                                     Run(state, works[k], threads, serial[k]->answer);
                                     Tell(state, serial[k]->share);
                                   })
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime()
          ->MeasureProcessCPUTime()
          ->MinTime(quick ? 0.05 : 0.5)
          ->Repetitions(quick ? 3 : 7);
    }
  }
  return RunAll(argc, argv);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
