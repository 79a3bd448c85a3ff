// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_support.h"

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel/memory_pages.h"
#include "core/solve.h"
#include "tests/support/lcp_problems.h"

namespace dlcs::bench {
namespace {

// A line of /proc/self/status, "VmHWM:  1234 kB", in bytes.
double MemoryBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != key) continue;
    double kilobytes = 0;
    status >> kilobytes;
    return 1024 * kilobytes;
  }
  return 0;
}

}  // namespace

Problem DensePairs(Index m, Index n) {
  testing::LcpGenerator generator(5);
  const double over_m = 0.5 / std::sqrt(static_cast<double>(m));
  Problem problem;
  problem.A = over_m * generator.Gaussian(m, m) - 2 * Matrix::Identity(m, m);
  problem.B = generator.Gaussian(m, n) / std::sqrt(static_cast<double>(n));
  problem.N = over_m * generator.Gaussian(n, m);
  problem.M = generator.MMatrix(n);
  problem.f = TimeFunction::Zero(m);
  constexpr Index kSamples = 65;
  std::vector<double> times(kSamples);
  Matrix g(n, kSamples);
  for (Index k = 0; k < kSamples; ++k) {
    times[k] = static_cast<double>(k) / (kSamples - 1);
    for (Index i = 0; i < n; ++i) g(i, k) = std::sin(3 * times[k] + 2.4 * static_cast<double>(i));
  }
  problem.g = TimeFunction::Sampled(std::move(times), std::move(g));
  problem.x0 = Vector::Ones(m);
  problem.horizon = 1;
  return problem;
}

std::string WhatIsWrong(const Solution& solution, double tolerance) {
  if (solution.termination != Termination::kReachedEnd) {
    return std::string(TerminationName(solution.termination)) + ": " + solution.message;
  }
  const Certificate& certificate = solution.certificate;
  const double scale = std::max(certificate.lcp_scale, 1e-300);
  if (!(certificate.node_residual <= tolerance * scale)) return "the LCPs at the nodes are not solved";
  if (!(certificate.node_complementarity <= tolerance * static_cast<double>(solution.y.rows()) * scale * scale))
    return "y and w are not complementary at the nodes";
  if (!solution.x.allFinite() || !solution.y.allFinite()) return "the trajectory is not finite";
  return "";
}

std::optional<Solution> SolveOrSkip(benchmark::State& state, const Problem& problem, const Options& options,
                                    double tolerance) {
  Observer observer;
  absl::StatusOr<Solution> solution = Solve(problem, options, observer, {});
  const std::string wrong =
      solution.ok() ? WhatIsWrong(*solution, tolerance) : std::string(solution.status().message());
  if (wrong.empty()) return *std::move(solution);
  state.SkipWithError(wrong.c_str());
  return std::nullopt;
}

double ProcessorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

PeakMemory::PeakMemory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;  // the peak is now what is in use
  before_ = MemoryBytes("VmRSS:");
}

double PeakMemory::Bytes() const { return std::max(0.0, MemoryBytes("VmHWM:") - before_); }

bool TakeFlag(int& argc, char** argv, const std::string& flag) {
  char** const end = argv + argc;
  char** const rest = std::remove_if(argv + 1, end, [&](const char* word) { return word == flag; });
  argc = static_cast<int>(rest - argv);
  return rest != end;
}

int RunAll(int argc, char** argv, Order order) {
  RetainFreedMemory();  // as dlcsd does
  std::vector<char*> words(argv, argv + argc);
  std::string shuffle = "--benchmark_enable_random_interleaving=true";
  if (order == Order::kShuffled) words.insert(words.begin() + 1, shuffle.data());
  argc = static_cast<int>(words.size());
  argv = words.data();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace dlcs::bench
