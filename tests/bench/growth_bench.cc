// SPDX-License-Identifier: Apache-2.0
// How time and memory grow with the number of steps J, of pairs n and of states m, on one thread: for dense matrices,
// for the Kronecker sum of the Signorini problem, and for sparse ones.
//
//     growth_bench [--quick] [Google Benchmark's flags]
//
// Each line carries the exponents that its family should have (expected_time, expected_memory); report.py
// fits the measured ones.

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/models/signorini.h"
#include "tests/bench/bench_support.h"
#include "tests/support/problems.h"
#include "tests/support/sparse_problems.h"

namespace dlcs::bench {
namespace {

struct Family {
  std::string name;
  std::vector<Index> sizes;
  double expected_time;  // exponents
  double expected_memory;
  std::function<Problem(Index size)> problem;
  std::function<Options(const Problem& problem, Index size)> options;
};

Options MakeOptions(Method method, Index steps) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  options.estimate_error = false;
  options.num_threads = 1;
  return options;
}

Problem Signorini(Index cells) {
  SignoriniModel model;
  model.cells = cells;
  return MakeSignoriniProblem(model).value();
}

Options AtTheEnd(const Problem& problem, Method method, PropagatorKind propagator, Index steps) {
  Options options = MakeOptions(method, steps);
  options.propagator = propagator;
  options.output_times = {problem.horizon};
  options.output_times_only = true;
  return options;
}

// Kronecker sums and sparse matrices: the state is wanted at the end only.
std::vector<Family> StructuredFamilies(const std::function<std::vector<Index>(std::vector<Index>)>& sizes) {
  const auto grid = [](Index states, Index constraints) {
    const auto side = static_cast<Index>(std::lround(std::sqrt(static_cast<double>(states))));
    return testing::AdvectedGrid({.side = side, .constraints = constraints, .speed = 0.3});
  };
  const auto options = [](Method method, PropagatorKind propagator, Index steps) {
    return [=](const Problem& problem, Index) { return AtTheEnd(problem, method, propagator, steps); };
  };
  constexpr Index kSteps = 100;
  const std::vector<Index> cells = sizes({16, 32, 64, 128, 256, 512});
  const std::vector<Index> states = sizes({100, 400, 1'600, 6'400, 25'600, 102'400});
  const auto kronecker = PropagatorKind::kKroneckerSum;
  return {
      // Q slow modes, each a short sum of exponentials; Q² log Q for the state at the end.
      {"m, Kronecker (size: 1 by Δx)/exponential-integrator", cells, 2, 2, Signorini,
       options(Method::kExponentialIntegrator, kronecker, kSteps)},
      // ... and more iterations for finer meshes.
      {"m, Kronecker (size: 1 by Δx)/laplace-iteration", cells, 2, 2, Signorini,
       options(Method::kLaplaceIteration, kronecker, kSteps)},
      // Nested dissection of a plane: m^{3/2} to factor, m log m a solve and in memory.
      {"m, sparse/time-stepping", states, 1.5, 1, [=](Index size) { return grid(size, 10); },
       options(Method::kTimeStepping, PropagatorKind::kSparseStepping, kSteps)},
      // The same for each of some two hundred nodes.
      {"m, sparse/contour, exponential-integrator", sizes({400, 900, 1'600, 3'600, 6'400, 10'000}), 1.5, 1,
       [=](Index size) { return grid(size, 10); },
       options(Method::kExponentialIntegrator, PropagatorKind::kContour, kSteps)},
      // A solve for each column of M^h, an n by n matrix.
      {"n, sparse/time-stepping", sizes({30, 60, 125, 250, 500, 1'000}), 1, 2,
       [=](Index size) { return grid(2'025, size); },
       options(Method::kTimeStepping, PropagatorKind::kSparseStepping, 20)},
  };
}

std::vector<Family> Families(bool quick) {
  const auto sizes = [&](std::vector<Index> all) {
    if (quick) all.resize(all.size() - 2);
    return all;
  };
  const std::vector<Index> steps = sizes({1'000, 3'000, 10'000, 30'000, 100'000, 300'000, 1'000'000});
  const std::vector<Index> dimensions = sizes({1, 4, 16, 64, 128, 256, 512, 1024});
  constexpr Index kFewSteps = 32;

  std::vector<Family> families;
  for (const Method method : {Method::kLaplaceIteration, Method::kExponentialIntegrator, Method::kTimeStepping}) {
    const std::string name = MethodName(method);
    // Windows of bounded length: the convolutions cost O(J log W).
    families.push_back({"J/" + name, steps, 1, 1, [](Index) { return testing::FourVariableEasy(); },
                        [=](const Problem&, Index size) { return MakeOptions(method, size); }});
    // The factorization of a basis; O(n²) a step where it stays.
    families.push_back({"n/" + name, dimensions, 3, 2, [](Index size) { return DensePairs(8, size); },
                        [=](const Problem&, Index) { return MakeOptions(method, kFewSteps); }});
    // The matrix functions of hA, dense; O(m²) a step.
    families.push_back({"m/" + name, dimensions, 3, 2, [](Index size) { return DensePairs(size, 2); },
                        [=](const Problem&, Index) { return MakeOptions(method, kFewSteps); }});
  }
  for (Family& family : StructuredFamilies(sizes)) families.push_back(std::move(family));
  return families;
}

void Run(benchmark::State& state, const Family& family, Index size) {
  const Problem problem = family.problem(size);
  const Options options = family.options(problem, size);
  const PeakMemory memory;
  for (auto _ : state) {
    if (!SolveOrSkip(state, problem, options)) return;
  }
  state.counters["size"] = static_cast<double>(size);
  state.counters["peak_bytes"] = memory.Bytes();
  state.counters["expected_time"] = family.expected_time;
  state.counters["expected_memory"] = family.expected_memory;
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) {
  using dlcs::bench::Family;
  const bool quick = dlcs::bench::TakeFlag(argc, argv, "--quick");
  const std::vector<Family> families = dlcs::bench::Families(quick);
  for (const Family& family : families) {
    for (const dlcs::Index size : family.sizes) {
      benchmark::RegisterBenchmark((family.name + "/" + std::to_string(size)).c_str(),
                                   [&family, size](benchmark::State& state) { dlcs::bench::Run(state, family, size); })
          ->Unit(benchmark::kMillisecond)
          ->MinTime(quick ? 0.02 : 0.1);
    }
  }
  return dlcs::bench::RunAll(argc, argv);
}
