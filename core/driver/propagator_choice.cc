// SPDX-License-Identifier: Apache-2.0
#include "core/driver/propagator_choice.h"

#include <utility>

#include "core/problem/solution.h"
#include "core/propagator/contour_system.h"
#include "core/propagator/kronecker_system.h"
#include "core/stepping/time_stepping.h"

namespace dlcs {
namespace {

// Up to here dense matrices cost microseconds a step.
constexpr Index kSmall = 64;
// Up to here they cost less than the factorizations of a contour.
constexpr Index kSmallSparse = 300;
// A contour costs as many solves for each node as there are constraints.
constexpr Index kFewConstraints = 200;
// For more states the two hundred factorizations of a contour take minutes, and the one of a step seconds: contours are
// then used only if the options name the method.
constexpr Index kLargestChosenContour = 20'000;
// From here on one matrix function takes minutes.
constexpr Index kLargestDense = 4000;

std::string States(const Problem& problem) { return "m = " + std::to_string(problem.num_states()); }

bool IsDenseAffordable(const Problem& problem) {
  return problem.num_states() <= kLargestDense && problem.A.FitsDense() && problem.B.FitsDense() &&
         problem.N.FitsDense() && problem.M.FitsDense();
}

PropagatorChoice Dense(std::string reason) {
  PropagatorChoice choice;
  choice.record = {.used = PropagatorKind::kDense, .reason = std::move(reason)};
  return choice;
}

PropagatorChoice Refuse(std::string refusal) {
  PropagatorChoice choice;
  choice.refusal = std::move(refusal);
  return choice;
}

PropagatorChoice Use(std::shared_ptr<Propagator> system) {
  PropagatorChoice choice;
  choice.record = system->record();
  choice.system = std::move(system);
  return choice;
}

PropagatorChoice DenseOrRefuse(const Problem& problem, std::string reason) {
  if (IsDenseAffordable(problem)) return Dense(std::move(reason));
  return Refuse("A is too large for dense matrices (" + States(problem) + "): " + reason + ".");
}

}  // namespace

PropagatorChoice ChoosePropagator(const Problem& problem, const Options& options, Method method, SetupCache* setups) {
  const PropagatorKind wanted = options.propagator;
  const bool reduced = method == Method::kExponentialIntegrator || method == Method::kLaplaceIteration;
  if (wanted == PropagatorKind::kDense) return DenseOrRefuse(problem, "asked for");
  if (method == Method::kTimeStepping && StepsSparsely(problem, options)) {
    PropagatorChoice choice;
    choice.record = {.used = PropagatorKind::kSparseStepping, .reason = "A is " + problem.A.Describe()};
    return choice;
  }
  if (!reduced) return DenseOrRefuse(problem, std::string(MethodName(method)) + " works on states");
  if (wanted == PropagatorKind::kAuto && problem.A.is_dense()) return Dense("A is dense");
  if (wanted == PropagatorKind::kAuto && problem.num_states() <= kSmall) return Dense(States(problem) + " is small");

  std::string why_not;
  if (wanted == PropagatorKind::kAuto || wanted == PropagatorKind::kKroneckerSum) {
    if (auto system = KroneckerSystem::Create(problem, why_not, setups)) return Use(std::move(system));
  }
  const bool few = problem.num_states() > kSmallSparse && problem.num_constraints() <= kFewConstraints;
  const bool too_slow = options.method == Method::kAuto && problem.num_states() > kLargestChosenContour;
  if (wanted == PropagatorKind::kAuto && few && too_slow) {
    why_not += "; a contour would take some two hundred factorizations";
  } else if (wanted == PropagatorKind::kContour || (wanted == PropagatorKind::kAuto && few)) {
    std::string why_no_contour;
    if (auto system = ContourSystem::Create(problem, options, why_no_contour, setups)) return Use(std::move(system));
    why_not += (why_not.empty() ? "" : "; ") + why_no_contour;
  }
  if (wanted == PropagatorKind::kAuto && options.method == Method::kAuto && problem.num_states() > kSmallSparse &&
      problem.num_constraints() > kFewConstraints && !problem.A.is_dense()) {
    return Refuse("matrix functions of a sparse A with " + States(problem) +
                  " would be dense, and a step with its sparse " + "factors costs far less" +
                  (why_not.empty() ? "" : "; " + why_not) + ".");
  }
  if (wanted == PropagatorKind::kSparseStepping) why_not = "sparse stepping is for time-stepping";
  if (wanted != PropagatorKind::kAuto) return Refuse("The chosen propagator cannot be used: " + why_not + ".");
  return DenseOrRefuse(problem, why_not);
}

std::optional<Problem> WithSparseMatrices(const Problem& problem, const Options& options) {
  constexpr double kMostlyZero = 0.05;
  const auto is_mostly_zero = [](const StructuredMatrix& matrix) {
    return matrix.is_dense() && static_cast<double>((matrix.Dense().array() != 0).count()) <=
                                    kMostlyZero * static_cast<double>(matrix.size());
  };
  const bool is_left_open = options.method == Method::kAuto && options.propagator == PropagatorKind::kAuto;
  const bool is_large = problem.num_states() > kSmallSparse && problem.num_constraints() > kFewConstraints;
  if (!is_left_open || !is_large || !is_mostly_zero(problem.A)) return std::nullopt;
  Problem sparse = problem;
  for (StructuredMatrix* matrix : {&sparse.A, &sparse.B, &sparse.N, &sparse.M}) {
    if (is_mostly_zero(*matrix)) *matrix = matrix->Sparse();
  }
  return sparse;
}

}  // namespace dlcs
