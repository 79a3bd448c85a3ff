// SPDX-License-Identifier: Apache-2.0
#include "tests/load/stop_cases.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/analyze.h"
#include "core/ensemble.h"
#include "core/nonlinear/solve_nonlinear.h"
#include "core/solve.h"
#include "tests/support/random_matrix.h"

namespace dlcs::load {
namespace {

using testing::RandomMatrix;

// Of spectral norm about 2.
Matrix Scattered(Index size, unsigned seed) {
  return RandomMatrix(size, size, seed) / std::sqrt(static_cast<double>(size));
}

// Stable, not normal, with complex eigenvalues.
Matrix Damped(Index size) { return Scattered(size, 1) - 2.5 * Matrix::Identity(size, size); }

// Positive definite, which is not visible in any single row.
Matrix Definite(Index size) { return Scattered(size, 2) + 2.5 * Matrix::Identity(size, size); }

// Positive semidefinite and nothing more: for Lemke's method.
Matrix Skew(Index size) {
  const Matrix scattered = Scattered(size, 3);
  return scattered - scattered.transpose();
}

// Every component another mixture of a few waves, so that y switches on and off all the time.
TimeFunction Waves(Index size, unsigned seed) {
  TimeFunction waves = TimeFunction::Formulas({"sin(3*t)", "cos(5*t)", "sin(7*t)", "cos(11*t)"});
  waves.lift = RandomMatrix(size, 4, seed);
  return waves;
}

Problem System(Matrix A, Matrix M, double horizon) {
  const Index m = A.rows(), n = M.rows();
  const double scale = 0.3 / std::sqrt(static_cast<double>(std::max(m, n)));
  Problem problem;
  problem.B = scale * RandomMatrix(m, n, 4);
  problem.N = scale * RandomMatrix(n, m, 5);
  problem.A = std::move(A);
  problem.M = std::move(M);
  problem.f = Waves(m, 6);
  problem.g = Waves(n, 7);
  problem.x0 = RandomMatrix(m, 1, 8);
  problem.horizon = horizon;
  return problem;
}

Options With(Method method, Index steps) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  options.num_threads = 1;
  options.output_times_only = true;
  return options;
}

bool IsStoppedOrDone(const Solution& solution) {
  return solution.termination == Termination::kCancelled || solution.termination == Termination::kReachedEnd;
}

// A ring of masses on hardening springs, each beside an elastic stop.
NonlinearProblem RingOf(Index size) {
  NonlinearProblem problem;
  for (Index i = 1; i <= size; ++i) {
    const std::string k = std::to_string(i), next = std::to_string(i % size + 1);
    problem.f.push_back("-2*x" + k + " - x" + k + "**3 + 0.5*x" + next + " + 2*cos(" + k + "*t) + y" + k);
    problem.g.push_back("3*y" + k + " + 0.5*y" + next + "**3 + x" + k + " - sin(3*t)");
  }
  problem.x0 = Vector::Zero(size);
  problem.horizon = 1000;
  return problem;
}

constexpr double kHorizon = 1000;
constexpr Index kFew = 4;

}  // namespace

Problem LongProblemOfPairs(Index pairs) { return System(Damped(kFew), Definite(pairs), kHorizon); }

std::vector<StopCase> StopCases(Index size) {
  constexpr Index kSteps = 1'000'000;
  const Index few = std::min(size, kFew);
  const Problem states = System(Damped(size), Definite(few), kHorizon);
  const Problem pairs = LongProblemOfPairs(size);

  std::vector<StopCase> cases;
  const auto add = [&](const char* name, const Problem& problem, Options options) {
    if (options.output_times.empty() && options.output_times_only) options.output_times = {problem.horizon};
    cases.push_back({name, problem, std::move(options)});
  };
  add("march, states", states, With(Method::kExponentialIntegrator, kSteps));
  add("march, pairs", pairs, With(Method::kExponentialIntegrator, kSteps));
  add("march, pairs by Lemke", System(Damped(few), Skew(size), kHorizon), With(Method::kExponentialIntegrator, kSteps));
  add("iteration, states", states, With(Method::kLaplaceIteration, kSteps));
  add("iteration, pairs", pairs, With(Method::kLaplaceIteration, kSteps));
  Options by_contour = With(Method::kLaplaceIteration, kSteps);
  by_contour.kernel = KernelSource::kContour;
  add("iteration, kernel by contours", states, by_contour);
  Problem short_states = states;
  short_states.horizon = 1;
  add("paper, states", short_states, With(Method::kWuChenIteration, 2000));
  add("time stepping, states", states, With(Method::kTimeStepping, kSteps));
  add("time stepping, pairs", pairs, With(Method::kTimeStepping, kSteps));
  Options newton = With(Method::kTimeStepping, kSteps);
  newton.step_solver = StepSolver::kNewton;
  add("time stepping, Newton, states", states, newton);
  add("time stepping, Newton, pairs", pairs, newton);
  Options located = With(Method::kEventDriven, 0);
  located.error_tolerance = 1e-6;
  add("events, states", states, located);
  add("events, pairs", pairs, located);
  Options by_itself = With(Method::kAuto, 0);
  by_itself.error_tolerance = 1e-6;
  add("tolerance, states", states, by_itself);
  return cases;
}

std::vector<StoppableWork> StoppableWorks(Index size) {
  std::vector<StoppableWork> works;
  for (StopCase& the_case : StopCases(size)) {
    const std::string name = the_case.name;
    works.push_back({name, [the_case = std::move(the_case)](std::stop_token stop) {
                       Observer nobody;
                       const auto solution = Solve(the_case.problem, the_case.options, nobody, stop);
                       return solution.ok() && IsStoppedOrDone(*solution);
                     }});
  }
  const Index few = std::min(size, kFew);
  const auto analyze = [&](const char* name, Problem problem) {
    works.push_back(
        {name, [problem = std::move(problem)](std::stop_token stop) { return Analyze(problem, {}, stop).ok(); }});
  };
  const Problem states = System(Damped(size), Definite(few), kHorizon);
  analyze("analysis, states", states);
  analyze("analysis, pairs", LongProblemOfPairs(size));
  analyze("analysis, pairs, skew M", System(Damped(few), Skew(size), kHorizon));
  Problem index_one = System(Damped(size), Matrix::Zero(size, size), kHorizon);
  index_one.B = Definite(size);
  index_one.N = Matrix::Identity(size, size);
  analyze("analysis, states and pairs, M = 0", index_one);

  works.push_back(
      {"ensemble, states and pairs", [base = System(Damped(size), Definite(size), kHorizon)](std::stop_token stop) {
         std::vector<EnsembleMember> members(64);
         for (std::size_t k = 0; k < members.size(); ++k) {
           members[k].x0 = RandomMatrix(base.num_states(), 1, static_cast<unsigned>(k));
         }
         bool holds = true;
         const absl::Status status = SolveEnsemble(
             base, members, With(Method::kExponentialIntegrator, 100'000),
             [&](Index, const Solution& solution) { holds = holds && IsStoppedOrDone(solution); }, stop);
         return status.ok() && holds;
       }});
  works.push_back({"nonlinear, states and pairs", [problem = RingOf(size)](std::stop_token stop) {
                     Observer nobody;
                     Options options;
                     options.num_steps = 100'000;
                     options.num_threads = 1;
                     options.output_times_only = true;
                     options.output_times = {problem.horizon};
                     const auto solution = SolveNonlinear(problem, options, nobody, stop);
                     return solution.ok() && IsStoppedOrDone(*solution);
                   }});
  return works;
}

}  // namespace dlcs::load
