// SPDX-License-Identifier: Apache-2.0
// Large sparse systems: time and peak memory. Peak memory is that of the process so far: run one benchmark at a time,
//
//     large_bench --benchmark_filter=Stepping/447

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>

#include "core/linalg/norms.h"
#include "core/linalg/sparse/multigrid_solver.h"
#include "core/linalg/weyl_sequence.h"
#include "core/models/signorini.h"
#include "core/solve.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

double PeakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// A certificate that does not hold, or another end than that of the horizon, is an error and no figure.
void Solve(benchmark::State& state, const Problem& problem, const Options& options) {
  for (auto _ : state) {
    Observer observer;
    const auto solution = dlcs::Solve(problem, options, observer, {});
    if (!solution.ok() || solution->termination != Termination::kReachedEnd) {
      state.SkipWithError(solution.ok() ? solution->message.c_str() : solution.status().ToString().c_str());
      return;
    }
    if (!(solution->certificate.node_residual <= 1e-9 * solution->certificate.lcp_scale)) {
      state.SkipWithError("the certificate does not hold");
      return;
    }
    state.counters["m"] = static_cast<double>(problem.num_states());
    state.counters["n"] = static_cast<double>(problem.num_constraints());
    state.counters["factorizations"] = static_cast<double>(solution->propagator.factorizations);
    state.counters["total_s"] = solution->cost.seconds_total;
    state.counters["setup_s"] = solution->cost.seconds_setup;
    state.counters["lcp_s"] = solution->cost.seconds_lcp;
    state.counters["residual"] = solution->certificate.node_residual / solution->certificate.lcp_scale;
    state.counters["predicted_MB"] = solution->cost.predicted_bytes / (1 << 20);
  }
  state.counters["peak_MB"] = PeakMegabytes();
}

Options AtTheEnd(Method method, PropagatorKind propagator) {
  Options options;
  options.method = method;
  options.propagator = propagator;
  options.num_steps = 400;
  options.estimate_error = false;
  options.output_times = {0.5, 1};
  options.output_times_only = true;
  return options;
}

Problem Plane(const benchmark::State& state, Index constraints) {
  return testing::AdvectedGrid({.side = state.range(0), .constraints = constraints, .speed = 0.3});
}

// 447² = 199,809 states, 50 constraints.
void BM_Stepping(benchmark::State& state) {
  Options options = AtTheEnd(Method::kTimeStepping, PropagatorKind::kSparseStepping);
  options.average_y = true;
  Solve(state, Plane(state, 50), options);
}
BENCHMARK(BM_Stepping)->Arg(100)->Arg(200)->Arg(447)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

// Some 200 sparse factorizations with 50 solves each: it pays where their kernel serves many solves.
void BM_Contour(benchmark::State& state) {
  Solve(state, Plane(state, 50), AtTheEnd(Method::kExponentialIntegrator, PropagatorKind::kContour));
}
BENCHMARK(BM_Contour)->Arg(50)->Arg(100)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

// As many constraints as every one of 45² = 2,025 states could have, with sparse M.
void BM_ManyConstraints(benchmark::State& state) {
  Options options = AtTheEnd(Method::kTimeStepping, PropagatorKind::kSparseStepping);
  options.average_y = true;
  options.num_steps = 100;
  options.estimate_error = false;
  Solve(state, testing::AdvectedGrid({.side = 45, .constraints = state.range(0), .speed = 0.3}), options);
}
BENCHMARK(BM_ManyConstraints)->Arg(500)->Arg(2000)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

// 100 steps of 1/100 for the wall with one-sided contact in `cells`³ cells, of implicit Euler or of second order,
// beside as many solves of I - hA from zero to 1e-8, set-ups excluded from both.
void BM_Wall(benchmark::State& state) {
  const bool is_euler = state.range(1) == 1;
  Problem problem =
      MakeSignoriniProblem({.cells = state.range(0), .dimensions = 3, .coefficient = 0.1, .horizon = 1}).value();
  problem.A = StructuredMatrix(problem.A.Sparse());
  Options options = AtTheEnd(is_euler ? Method::kTimeStepping : Method::kAuto,
                             is_euler ? PropagatorKind::kIterativeStepping : PropagatorKind::kAuto);
  options.num_steps = 100;
  options.num_threads = 1;
  Solve(state, problem, options);
  if (!state.counters.contains("setup_s")) return;

  SparseMatrix K(problem.num_states(), problem.num_states());
  K.setIdentity();
  K -= 0.01 * problem.A.Sparse();
  Workers workers(1);
  MultigridSolver solver(K, workers);
  Vector b(K.rows());
  double seconds = 0;
  for (int k = 0; k < 100; ++k) {
    for (Index i = 0; i < b.size(); ++i) b[i] = WeylValue(static_cast<double>(i + k * b.size()));
    Vector x = Vector::Zero(b.size());
    const auto begin = std::chrono::steady_clock::now();
    solver.Start(b, x, {.split = K.rows()});
    if (!solver.Reduce(1e-8 * MaxAbs(b), 1000)) return state.SkipWithError("a solve of I - hA did not end");
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  state.counters["solves_s"] = seconds;
  state.counters["steps_over_solves"] = (state.counters["total_s"] - state.counters["setup_s"]) / seconds;
}
BENCHMARK(BM_Wall)
    ->ArgNames({"cells", "order"})
    ->ArgsProduct({{25, 41, 101}, {1, 2}})
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

}  // namespace
}  // namespace dlcs

BENCHMARK_MAIN();
