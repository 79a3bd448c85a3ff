// SPDX-License-Identifier: Apache-2.0
// What the benchmarks have in common: answers that are checked, memory that is measured, a short run.

#ifndef DLCS_TESTS_BENCH_BENCH_SUPPORT_H_
#define DLCS_TESTS_BENCH_BENCH_SUPPORT_H_

#include <benchmark/benchmark.h>

#include <optional>
#include <string>

#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs::bench {

// The "error" of a run that was left out because it would have told nothing new, or taken too long: no failure.
inline constexpr const char* kNotNeeded = "not needed";

// The largest residual of an LCP that counts as solved, relative to its numbers.
inline constexpr double kResidualTolerance = 1e-9;

// m damped states, coupled at random, that are driven through n pairs with a dense M-matrix. Half of the g_i are
// negative at any time; they are sampled, since formulas would cost more than the LCPs.
Problem DensePairs(Index m, Index n);

// Why `solution` does not count: it did not converge, or its residuals at the nodes are not those of a solution.
// Empty where it counts. NaN does not.
std::string WhatIsWrong(const Solution& solution, double tolerance = kResidualTolerance);

// Solves; where the answer does not count, marks `state` as failed and returns nothing.
std::optional<Solution> SolveOrSkip(benchmark::State& state, const Problem& problem, const Options& options,
                                    double tolerance = kResidualTolerance);

// Of the processor, in this process: other programs do not count.
double ProcessorSeconds();

// The most memory (resident set) that the process took since it was made, above what it had then.
// Page by page: what stays below some 100 KB is noise.
class PeakMemory {
 public:
  PeakMemory();
  double Bytes() const;

 private:
  double before_;
};

// Whether `flag` is among the arguments, which are left without it.
bool TakeFlag(int& argc, char** argv, const std::string& flag);

// Repetitions of one benchmark one after the other, or shuffled among those of all: where they are compared with each
// other on a machine that others use too.
enum class Order { kAsRegistered, kShuffled };

// Runs what was registered, as BENCHMARK_MAIN() does. Returns the exit code.
int RunAll(int argc, char** argv, Order order = Order::kAsRegistered);

}  // namespace dlcs::bench

#endif  // DLCS_TESTS_BENCH_BENCH_SUPPORT_H_
