// SPDX-License-Identifier: Apache-2.0
// The iterates of a system, one by one: what the figures of [Wu & Chen] show and no result of a solve holds.
//
//     iterates SYSTEM METHOD STEPS COUNT PREFIX [K...]
//
// SYSTEM is a problem file, or signorini:CELLS:COEFFICIENT. The whole horizon is one window; laplace-iteration
// starts from the equation solved with y frozen at its first value, wu-chen-iteration from the constant x0.
// Prints the number of iterations to convergence, and writes
//
// - PREFIX-history.csv: k, error, change, log10_bound for k = 1 ... COUNT, the largest distance of x^k to the
//   converged solution, of N x^k (wu-chen-iteration: x^k) to the iterate before, and the a-priori bound of the
//   error by Theorem 2.2, empty where there is none;
// - PREFIX-K.csv: t, y1, y2, ... of iterate K, with x1, x2, ... before them where there are at most 10 states;
// - PREFIX-converged.csv: the same of the converged solution.

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/files/problem_file.h"
#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "core/solve.h"
#include "server/wire/convert.h"

namespace dlcs::bench {
namespace {

Problem ReadSystem(const std::string& name) {
  const std::string kind = "signorini:";
  if (name.rfind(kind, 0) == 0) {
    SignoriniModel model;
    const std::size_t colon = name.find(':', kind.size());
    model.cells = std::stol(name.substr(kind.size()));
    model.coefficient = std::stod(name.substr(colon + 1));
    return MakeSignoriniProblem(model).value();
  }
  std::vector<Violation> violations;
  return ProblemFromProto(client::ReadProblemFile(name).value().problem, violations);
}

// What the iterations tell.
class History final : public Observer {
 public:
  void OnIterate(const IterateReport& iterate, const IterateValues&) override { iterates.push_back(iterate); }
  std::vector<IterateReport> iterates;
};

Solution SolveFor(const Problem& problem, Method method, Index steps, Index iterations, Observer& observer) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  options.estimate_error = false;
  options.window_steps = Options::kWholeHorizon;
  options.max_iterations = iterations;
  options.num_threads = 1;
  options.iteration_tolerance = 1e-14;
  if (problem.A.kronecker_sum() != nullptr) options.propagator = PropagatorKind::kKroneckerSum;
  return Solve(problem, options, observer, {}).value();
}

void WriteTrajectory(const Solution& solution, const std::string& path) {
  constexpr Index kFewStates = 10;
  const Index states = solution.x.rows() <= kFewStates ? solution.x.rows() : 0;
  std::ofstream file(path);
  file.precision(12);
  file << "t";
  for (Index i = 1; i <= states; ++i) file << ",x" << i;
  for (Index i = 1; i <= solution.y.rows(); ++i) file << ",y" << i;
  file << "\n";
  for (std::size_t j = 0; j < solution.times.size(); ++j) {
    const auto column = static_cast<Index>(j);
    file << solution.times[j];
    for (Index i = 0; i < states; ++i) file << "," << solution.x(i, column);
    for (Index i = 0; i < solution.y.rows(); ++i) file << "," << solution.y(i, column);
    file << "\n";
  }
}

// log10 of the bound of ‖x^k - x*‖: the factor of the change after it, times the distance of the start.
double LogErrorBound(const History& history, Index k, double distance_of_start) {
  const auto next = static_cast<std::size_t>(k);
  if (next >= history.iterates.size() || !history.iterates[next].log10_bound) return std::nan("");
  return *history.iterates[next].log10_bound - std::log10(history.iterates[0].change) + std::log10(distance_of_start);
}

int Main(int argc, char** argv) {
  if (argc < 6) throw std::invalid_argument("usage: iterates SYSTEM METHOD STEPS COUNT PREFIX [K...]");
  const Problem problem = ReadSystem(argv[1]);
  const Method method = std::string(argv[2]) == MethodName(Method::kWuChenIteration) ? Method::kWuChenIteration
                                                                                     : Method::kLaplaceIteration;
  const Index steps = std::stol(argv[3]), count = std::stol(argv[4]);
  const std::string prefix = argv[5];
  std::set<Index> kept;
  for (int i = 6; i < argc; ++i) kept.insert(std::stol(argv[i]));

  Observer silent;
  History history;
  const Solution converged = SolveFor(problem, method, steps, 0, history);
  if (converged.termination != Termination::kReachedEnd) throw std::runtime_error(converged.message);
  WriteTrajectory(converged, prefix + "-converged.csv");
  std::printf("%lld\n", static_cast<long long>(converged.cost.iterations));

  const double start = MaxAbs(converged.x.colwise() - problem.x0);
  std::ofstream file(prefix + "-history.csv");
  file << "k,error,change,log10_bound\n";
  for (Index k = 1; k <= count; ++k) {
    const Solution iterate = SolveFor(problem, method, steps, k, silent);
    if (iterate.x.cols() != converged.x.cols()) throw std::runtime_error(iterate.message);
    if (kept.count(k) > 0) WriteTrajectory(iterate, prefix + "-" + std::to_string(k) + ".csv");
    const auto at = static_cast<std::size_t>(k - 1);
    const double bound = LogErrorBound(history, k, start);
    file << k << "," << MaxAbs(iterate.x - converged.x) << ",";
    if (at < history.iterates.size()) file << history.iterates[at].change;
    file << ",";
    if (std::isfinite(bound)) file << bound;
    file << "\n";
  }
  return 0;
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) {
  try {
    return dlcs::bench::Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "iterates: %s\n", error.what());
    return 1;
  }
}
