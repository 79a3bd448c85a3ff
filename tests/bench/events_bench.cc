// SPDX-License-Identifier: Apache-2.0
// Time of a whole solve by event location, from problem to answer, at several tolerances. The error stands beside it,
// and a solve whose error is above the tolerance counts as none.

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

constexpr double kTightest = 1e-12;

Solution SolveAt(const Problem& problem, double tolerance) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = tolerance;
  options.output_times = {0, problem.horizon};
  options.output_times_only = true;
  options.project_initial_state = true;
  options.num_threads = 1;
  Observer silent;
  return Solve(problem, options, silent, {}).value();
}

// The difference of x at T to that of the tightest tolerance, relative.
double ErrorAtEnd(const Solution& solution, const Solution& best) {
  const Vector x = solution.x.rightCols(1), x_best = best.x.rightCols(1);
  return MaxAbs(x - x_best) / RowMaxAbs(best.x).maxCoeff();
}

void Report(benchmark::State& state, const Problem& problem, double tolerance) {
  const Solution best = SolveAt(problem, kTightest);
  Solution solution;
  for (auto _ : state) {
    solution = SolveAt(problem, tolerance);
    benchmark::DoNotOptimize(solution);
  }
  const double error = ErrorAtEnd(solution, best);
  if (!(error <= tolerance)) state.SkipWithError("the error is above the tolerance");
  state.counters["error"] = error;
  state.counters["steps"] = static_cast<double>(solution.cost.steps);
  state.counters["events"] = static_cast<double>(solution.switching_times.size() - 1);
  state.counters["LCPs"] = static_cast<double>(solution.cost.lcps);
}

void Register(const std::string& name, const Problem& problem) {
  for (const double tolerance : {1e-4, 1e-6, 1e-9}) {
    const std::string digits = std::to_string(static_cast<int>(-std::log10(tolerance) + 0.5));
    benchmark::RegisterBenchmark((name + "/1e-" + digits).c_str(),
                                 [problem, tolerance](benchmark::State& state) { Report(state, problem, tolerance); });
  }
}

}  // namespace
}  // namespace dlcs

int main(int argc, char** argv) {
  dlcs::Register("example-4.1", dlcs::testing::ExampleFourOne());
  dlcs::Register("four-variables-easy", dlcs::testing::FourVariableEasy());
  dlcs::Register("four-variables-hard", dlcs::testing::FourVariableHard());
  for (const char* name :
       {"abb_circuit_a", "abb_circuit_c", "diode_bridge", "diode_bridge_cap", "friction_oscillator", "relay_sliding"}) {
    dlcs::Register(name, dlcs::testing::LoadCase(name).problem);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
