// SPDX-License-Identifier: Apache-2.0
// The periodic steady state of a rectifier that settles in N periods, beside the transient of N periods: processor time
// of one thread, both to the default error. A line counts where the two agree.
//
//     periodic_bench [--quick]
//
// A sine charges a capacitor over a diode with a resistance, and a second one over a filter; the load is such that what
// is left of a start decays to 1e-6 in N periods. --quick leaves out N = 100,000.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/bench/bench_support.h"

namespace dlcs::bench {
namespace {

constexpr double kSettled = 1e-6;
constexpr double kGoal = 25;  // times the number of periods: N/25

// x1: the first capacitor, x2: the current of the filter, x3: the second capacitor; period 1.
Problem Rectifier(double periods) {
  const double slow = periods / std::log(1 / kSettled);  // the time constant
  const double load = 50, capacity = slow / load, resistance = 2;
  Problem problem;
  problem.A = Matrix{{0, -1, 0}, {1, -resistance, -1}, {0, 1 / capacity, -1 / (load * capacity)}};
  problem.B = Matrix{{1}, {0}, {0}};
  problem.N = Matrix{{1, 0, 0}};
  problem.M = Matrix{{load}};  // so large that the source does not shorten the time constant much
  problem.f = TimeFunction::Zero(3);
  problem.g = TimeFunction::Formulas({"-10*sin(2*pi*t)"});
  problem.x0 = Vector::Zero(3);
  problem.horizon = periods;
  return problem;
}

struct Run {
  Solution solution;
  double seconds = 0;
};

Run SolveOnce(const Problem& problem, double period) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = Options::kDefaultErrorTolerance;
  options.period = period;
  options.output_times = {0, period > 0 ? period : problem.horizon};
  options.output_times_only = true;
  options.num_threads = 1;
  Observer silent;
  const double begin = ProcessorSeconds();
  Run run{.solution = Solve(problem, options, silent, {}).value()};
  run.seconds = ProcessorSeconds() - begin;
  return run;
}

void Report(benchmark::State& state, double periods) {
  const Problem problem = Rectifier(periods);
  Run steady;
  double best = 1e9;
  for (auto _ : state) {
    steady = SolveOnce(problem, 1);
    best = std::min(best, steady.seconds);
  }
  const Run transient = SolveOnce(problem, 0);
  const Verdict verdict = JudgeSolution(steady.solution);
  if (verdict.kind != VerdictKind::kSolved) return state.SkipWithError(verdict.text.c_str());
  const Vector size = transient.solution.x.cwiseAbs().rowwise().maxCoeff();
  const Vector apart = (steady.solution.x.rightCols(1) - transient.solution.x.rightCols(1)).cwiseAbs();
  const double difference = MaxAbs(apart.cwiseQuotient(size));
  if (!(difference <= 10 * kSettled)) return state.SkipWithError("the transient ends elsewhere");
  state.counters["difference"] = difference;
  state.counters["integrated"] = static_cast<double>(steady.solution.periodic->periods);
  state.counters["steady_ms"] = 1e3 * best;
  state.counters["transient_ms"] = 1e3 * transient.seconds;
  state.counters["ratio"] = transient.seconds / best;
  state.counters["goal"] = periods / kGoal;
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) {
  const bool quick = dlcs::bench::TakeFlag(argc, argv, "--quick");
  for (const double periods : {1e3, 1e5}) {
    if (quick && periods > 1e4) continue;
    benchmark::RegisterBenchmark(("rectifier/" + std::to_string(static_cast<int>(periods))).c_str(),
                                 [periods](benchmark::State& state) { dlcs::bench::Report(state, periods); })
        ->Iterations(5);
  }
  return dlcs::bench::RunAll(argc, argv);
}
