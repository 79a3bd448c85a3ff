// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/known_systems.h"

#include <limits>

#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs::bench {
namespace {

constexpr double kTightest = 1e-13;

double RelativeError(const Matrix& x, const Matrix& reference) {
  const Vector sizes = RowMaxAbs(reference).cwiseMax(std::numeric_limits<double>::min());
  return MaxAbs(sizes.cwiseInverse().asDiagonal() * (x - reference));
}

std::vector<double> EvenTimes(double horizon, Index count) {
  std::vector<double> times;
  for (Index k = 1; k <= count; ++k) times.push_back(horizon * static_cast<double>(k) / static_cast<double>(count));
  return times;
}

Matrix SolveByStepping(const KnownSystem& system, Index steps) {
  Observer silent;
  return Solve(system.problem, OptionsFor(system, Method::kExponentialIntegrator, false, steps), silent, {}).value().x;
}

KnownSystem ExampleFourOne() {
  KnownSystem system{"example 4.1", testing::ExampleFourOne(), EvenTimes(1, 16), {}, 1e-15, Index{1} << 20};
  system.x.resize(2, 16);
  for (Index k = 0; k < 16; ++k) system.x.col(k) = testing::ExampleFourOneExact(system.times[k]);
  return system;
}

// By event location, with the distance of a fine march as its uncertainty.
KnownSystem FourVariables(const std::string& name, Problem problem, bool quick) {
  KnownSystem system{name, std::move(problem), EvenTimes(1, 16), {}, 0, Index{1} << 20};
  system.x = SolveByEvents(system, kTightest).value().x;
  system.uncertainty = RelativeError(SolveByStepping(system, Index{1} << (quick ? 17 : 21)), system.x);
  return system;
}

// With the references of tests/cases, which another program made by another method.
KnownSystem FromCase(const std::string& name, bool y_is_lipschitz) {
  const testing::Case the_case = testing::LoadCase(name);
  KnownSystem system{
      name, the_case.problem, testing::ReferenceTimes(the_case), {}, the_case.reference_accuracy, Index{1} << 19};
  system.y_is_lipschitz = y_is_lipschitz;
  system.x.resize(the_case.problem.num_states(), static_cast<Index>(system.times.size()));
  for (Index k = 0; k < system.x.cols(); ++k) system.x.col(k) = the_case.references[k].x;
  return system;
}

// By exp-PL on a grid finer than any that is measured, with the distance of the same on half of it as its uncertainty:
// the trapezoidal rule, which has 1521 states to step through, would take longer than all the rest.
KnownSystem Signorini(bool quick) {
  SignoriniModel model;
  model.cells = 40;
  KnownSystem system{"Signorini 1/40",      *MakeSignoriniProblem(model), EvenTimes(model.horizon, 16), {}, 0,
                     1 << (quick ? 10 : 13)};
  system.has_few_states = false;
  system.x = SolveByStepping(system, 16 * system.most_steps);
  system.uncertainty = RelativeError(SolveByStepping(system, 8 * system.most_steps), system.x);
  return system;
}

}  // namespace

std::vector<KnownSystem> KnownSystems(bool quick) {
  std::vector<KnownSystem> systems = {ExampleFourOne(),
                                      FourVariables("four variables, easy", testing::FourVariableEasy(), quick),
                                      FourVariables("four variables, hard", testing::FourVariableHard(), quick)};
  systems.back().breaks_down = true;
  for (const char* name : {"rlcd", "observer_lcs", "wall_permeable", "z_least"})
    systems.push_back(FromCase(name, true));
  for (const char* name : {"diode_bridge", "friction_oscillator"}) systems.push_back(FromCase(name, false));
  systems.push_back(Signorini(quick));
  return systems;
}

double TrueError(const KnownSystem& system, const Solution& solution) { return RelativeError(solution.x, system.x); }

Options OptionsFor(const KnownSystem& system) {
  Options options;
  options.output_times = system.times;
  options.output_times_only = true;
  options.num_threads = 1;
  return options;
}

Options OptionsFor(const KnownSystem& system, Method method, bool averaged, Index steps) {
  Options options = OptionsFor(system);
  options.method = method;
  options.average_y = averaged;
  options.theta = averaged ? 0.5 : 0;
  options.num_steps = steps;
  options.estimate_error = false;
  return options;
}

absl::StatusOr<Solution> SolveByEvents(const KnownSystem& system, double tolerance) {
  Options options = OptionsFor(system);
  options.method = Method::kEventDriven;
  options.error_tolerance = tolerance;
  Observer silent;
  return Solve(system.problem, options, silent, {});
}

}  // namespace dlcs::bench
