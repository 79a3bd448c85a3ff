// SPDX-License-Identifier: Apache-2.0
#include "core/driver/propagator_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/discretization/graded_grid.h"
#include "core/discretization/grid.h"
#include "core/discretization/step_rule.h"
#include "core/driver/step_memory.h"
#include "core/linalg/sparse/krylov_solver.h"
#include "core/linalg/sparse/sparse_factor.h"
#include "core/problem/mass_factor.h"
#include "core/problem/mass_matrix.h"
#include "core/problem/solution.h"
#include "core/propagator/contour_system.h"
#include "core/propagator/kronecker_system.h"
#include "core/stepping/iterative_step.h"
#include "core/stepping/time_stepping.h"

namespace dlcs {
namespace {

// Up to here dense matrices cost microseconds a step.
constexpr Index kSmall = 64;
// Up to here matrices of a sparse A may as well be dense.
constexpr Index kSmallSparse = 300;
// A contour costs as many solves for each node as there are constraints: above, it is made only where it is asked for.
constexpr Index kFewConstraints = 200;
// From here on one matrix function takes minutes.
constexpr Index kLargestDense = 4000;

std::string States(const Problem& problem) { return "m = " + std::to_string(problem.num_states()); }

// Dense matrices do not know E (FormToSolve()).
bool IsDenseAffordable(const Problem& problem) {
  return !problem.has_mass() && problem.num_states() <= kLargestDense && problem.A.FitsDense() &&
         problem.B.FitsDense() && problem.N.FitsDense() && problem.M.FitsDense();
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

// The steps of a solve, of all lengths. Where they are found by trial, there are some 64 + 128 + ... + 4096 for the
// default tolerance, and four trials at least, which show the order.
struct StepCount {
  double steps, lengths;
};

// How often the steps of the first trial are halved: once for each digit that is asked for, up to the default.
double HalvingsUpTo(const Options& options) {
  const double of_default = -std::log10(Options::kDefaultErrorTolerance);
  return options.error_tolerance > 0 ? std::clamp(-std::log10(options.error_tolerance), 3.0, of_default) : of_default;
}

double StepsOfLastTrial(const Options& options) {
  return static_cast<double>(kFirstTrialSteps) * std::exp2(HalvingsUpTo(options));
}

StepCount StepsInAll(const Problem& problem, const Options& options) {
  if (!options.has_grid()) {
    return {2 * StepsOfLastTrial(options) - static_cast<double>(kFirstTrialSteps), 1 + HalvingsUpTo(options)};
  }
  const double given = CountSteps(problem.horizon, BreakPoints(problem), options);
  return options.estimate_error ? StepCount{given + given / 2 + given / 4, 3} : StepCount{given, 1};
}

// The same for steps, which resolve how fast components start to move: trials have shorter steps behind layers
// (core/discretization/graded_grid.h), here those behind 0, up to twice as many as there are without.
StepCount SteppingStepsInAll(const Problem& problem, const Options& options) {
  StepCount count = StepsInAll(problem, options);
  if (options.has_grid() || !(options.error_tolerance > 0)) return count;
  const auto first_trial = static_cast<double>(kFirstTrialSteps);
  const double scales = std::log2(problem.horizon / first_trial / FastestStep(problem));
  const double levels = std::clamp(scales / std::log2(kRatioOfLevels), 0.0, 2 * first_trial / kStepsOfALevel);
  return {count.steps * (1 + kStepsOfALevel * levels / first_trial), count.lengths * (1 + levels)};
}

// Predicted seconds of a solve with a sparse A on one thread, without its LCPs, which all ways but iterating share.
struct Seconds {
  double contour, dense, stepping;
  double lcps_of_stepping, iterating;  // iterating with its LCPs
};

// Whether a step is to have two stages if the method becomes one of steps.
bool MayHaveTwoStages(const Options& options) {
  return options.method == Method::kAuto && options.theta == 0 && !options.average_y;
}

// Bounds the spectral radius of the Jacobi matrix of I - sA for a symmetric A without E, for the shift s of the longest
// step of the last trial or of the steps that are given; else 1. Pairs do not count.
double JacobiRadius(const Problem& problem, const Options& options) {
  if (problem.has_mass()) return 1;
  const SparseMatrix A = problem.A.Sparse();
  if (!IsSymmetric(A)) return 1;
  const double steps =
      options.has_grid() ? CountSteps(problem.horizon, BreakPoints(problem), options) : StepsOfLastTrial(options);
  const double h = problem.horizon / steps * (MayHaveTwoStages(options) ? StepRule::kStage : 1);
  const Vector diagonal = A.diagonal();
  const Vector others = problem.A.AbsTimes(Vector::Ones(A.rows())) - diagonal.cwiseAbs();
  const Vector pivots = 1 - h * diagonal.array();
  if (!(pivots.minCoeff() > 0)) return 1;
  return h * others.cwiseQuotient(pivots).maxCoeff();
}

// The constants were measured on grids of one to three dimensions with m from 343 to 20,000 and n from 2 to 150, where
// each prediction is within a factor of four. What they decide between differs by ten to a hundred.
Seconds PredictSeconds(const Problem& problem, const Options& options, const FactorSize& factor) {
  // Table: measured seconds for an entry, a multiplication or a state, and numbers of iterations; those with the
  // diagonal as preconditioner are per square root of the condition number.
  constexpr double kKrylovEntry = 1e-8, kKrylovStart = 1e-5, kKrylovIterations = 12, kSetupIterations = 20,
                   kDiagonalEntry = 1.5e-9, kDiagonalIterations = 9, kLcpSetup = 3.5e-10, kLcp = 2e-9,
                   kMultiplication = 1.4e-9, kContourEntry = 1e-4, kContourTerms = 100, kDenseSetup = 3e-9,
                   kCholesky = 5e-10, kLu = 8e-10, kFactorEntry = 5e-10,
                   kState = 5e-8;  // sources, certificate and records of a step
  const auto m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  const auto [steps, lengths] = StepsInAll(problem, options);
  const auto [in_steps, in_lengths] = SteppingStepsInAll(problem, options);
  const double radius = JacobiRadius(problem, options);
  const bool by_diagonal = radius <= KrylovSolver::kDominated;
  const double iteration = kKrylovStart + (by_diagonal ? kDiagonalEntry : kKrylovEntry) * factor.matrix_nonzeros;
  const double iterations =
      by_diagonal ? kDiagonalIterations * std::sqrt((1 + radius) / (1 - radius)) : kKrylovIterations;
  const double factoring = factor.multiplications * (IsSymmetric(problem.A.Sparse()) ? kCholesky : kLu);
  const double solve = 2 * factor.nonzeros * kFactorEntry;
  const double stages = MayHaveTwoStages(options) ? 2 : 1;
  return {
      .contour = lengths * kContourEntry * factor.nonzeros + steps * 2 * n * n * kContourTerms * kMultiplication,
      .dense = lengths * kDenseSetup * m * m * m + steps * m * m * kMultiplication,
      .stepping = in_lengths * (factoring + n * solve) + in_steps * (stages * solve + kState * m),
      .lcps_of_stepping = in_lengths * kLcpSetup * n * n * n + in_steps * kLcp * n * n,
      .iterating = (in_lengths * kSetupIterations + in_steps * stages * iterations) * iteration,
  };
}

std::string SecondsText(double seconds) {
  return seconds < 10 ? absl::StrFormat("%.2g s", seconds) : absl::StrFormat("%.0f s", seconds);
}

// Why steps with sparse factors are taken instead of a matrix function of a sparse A; empty if they are not.
std::string WhyStepsAreCheaper(const Problem& problem, const Options& options, const std::string& why_no_structure) {
  const Seconds predicted = PredictSeconds(problem, options, PredictFactor(problem.A.Sparse(), problem.E.Sparse()));
  const bool can_have_contour = problem.num_states() > kSmallSparse && problem.num_constraints() <= kFewConstraints;
  const double dense = IsDenseAffordable(problem) ? predicted.dense : std::numeric_limits<double>::infinity();
  const double other = can_have_contour ? std::min(predicted.contour, dense) : dense;
  if (predicted.stepping >= other) return "";
  std::string why = "steps with sparse factors are predicted to take " + SecondsText(predicted.stepping);
  why += std::isfinite(other) ? ", and with matrix functions of A " + SecondsText(other)
                              : ", and matrix functions of A with " + States(problem) + " would be dense";
  return why + (why_no_structure.empty() ? "" : "; " + why_no_structure);
}

PropagatorChoice Stepping(PropagatorKind kind, std::string reason, double factor_nonzeros = 0) {
  PropagatorChoice choice;
  choice.record = {.used = kind, .reason = std::move(reason)};
  choice.factor_nonzeros = factor_nonzeros;
  return choice;
}

// Why steps cannot be iterative; empty if they can.
std::string WhyNotIterative(const Problem& problem, Selection selection) {
  if (selection != Selection::kUnique && selection != Selection::kAny) {
    return std::string("iterative steps do not look for ") + SelectionName(selection);
  }
  return IterativeStep::WhyNot(problem);
}

// By sparse factors or without them, as the options say, or else by what is predicted to fit and to take less time.
PropagatorChoice ChooseStepping(const Problem& problem, const Options& options, Selection selection) {
  const std::string description = "A is " + problem.A.Describe();
  if (options.propagator == PropagatorKind::kSparseStepping) {
    return Stepping(PropagatorKind::kSparseStepping, description);
  }
  const std::string why_not = WhyNotIterative(problem, selection);
  if (options.propagator == PropagatorKind::kIterativeStepping) {
    if (!why_not.empty()) return Refuse("The chosen propagator cannot be used: " + why_not + ".");
    return Stepping(PropagatorKind::kIterativeStepping, "asked for");
  }
  if (!why_not.empty()) return Stepping(PropagatorKind::kSparseStepping, description);
  const std::string too_large =
      description + ", and what sparse factors need would not fit into the memory allowed (--max-memory)";
  // Before the prediction of their size, which itself takes seconds for a million states.
  if (SparseStepBytes(problem, 0) > options.max_memory) return Stepping(PropagatorKind::kIterativeStepping, too_large);
  // Where factors take hardly any time their residuals are preferred, those of rounding.
  constexpr double kHardlyAnyTime_s = 0.1;
  const auto chosen_if_faster = [&](const FactorSize& factor, const char* sparse_factors) {
    const Seconds predicted = PredictSeconds(problem, options, factor);
    const double direct = predicted.stepping + predicted.lcps_of_stepping;
    std::string why;
    if (direct > kHardlyAnyTime_s && predicted.iterating < direct) {
      why = description + "; iterative steps are predicted to take " + SecondsText(predicted.iterating) +
            sparse_factors + SecondsText(direct);
    }
    return why;
  };
  const SparseMatrix A = problem.A.Sparse();
  const auto entries = static_cast<double>(A.nonZeros());
  const FactorSize without_fill{.nonzeros = entries / 2, .multiplications = 0, .matrix_nonzeros = entries};
  if (std::string why = chosen_if_faster(without_fill, ", and sparse factors at least "); !why.empty()) {
    return Stepping(PropagatorKind::kIterativeStepping, std::move(why));
  }
  const FactorSize factor = PredictFactor(A, problem.E.Sparse());
  if (SparseStepBytes(problem, factor.nonzeros) > options.max_memory) {
    return Stepping(PropagatorKind::kIterativeStepping, too_large);
  }
  if (std::string why = chosen_if_faster(factor, ", and sparse factors "); !why.empty()) {
    return Stepping(PropagatorKind::kIterativeStepping, std::move(why));
  }
  return Stepping(PropagatorKind::kSparseStepping, description, factor.nonzeros);
}

PropagatorChoice DenseOrRefuse(const Problem& problem, std::string reason) {
  if (IsDenseAffordable(problem)) return Dense(std::move(reason));
  if (problem.has_mass()) {
    const bool small = problem.num_states() <= kLargestDense;
    return Refuse(std::string("The mass matrix E is kept, since ") +
                  (small ? "A is sparse" : "E⁻¹A would be too large (" + States(problem) + ")") + ": " + reason +
                  (small ? ". The propagator dense multiplies by E⁻¹." : "."));
  }
  return Refuse("A is too large for dense matrices (" + States(problem) + "): " + reason + ".");
}

}  // namespace

PropagatorChoice ChoosePropagator(const Problem& problem, const Options& options, Method method, Selection selection,
                                  SetupCache* setups) {
  const PropagatorKind wanted = options.propagator;
  const bool reduced = method == Method::kExponentialIntegrator || method == Method::kLaplaceIteration;
  if (wanted == PropagatorKind::kDense) return DenseOrRefuse(problem, "asked for");
  if (method == Method::kTimeStepping && StepsSparsely(problem, options)) {
    return ChooseStepping(problem, options, selection);
  }
  if (!reduced) return DenseOrRefuse(problem, std::string(MethodName(method)) + " works on states");
  if (wanted == PropagatorKind::kAuto && problem.A.is_dense()) return Dense("A is dense");
  if (wanted == PropagatorKind::kAuto && problem.num_states() <= kSmall) return Dense(States(problem) + " is small");

  std::string why_not;
  if (wanted == PropagatorKind::kAuto || wanted == PropagatorKind::kKroneckerSum) {
    if (auto system = KroneckerSystem::Create(problem, why_not, setups)) return Use(std::move(system));
  }
  if (wanted == PropagatorKind::kAuto && options.method == Method::kAuto && StepsSparsely(problem, options)) {
    if (std::string why = WhyStepsAreCheaper(problem, options, why_not); !why.empty()) return Refuse(std::move(why));
  }
  const bool few = problem.num_states() > kSmallSparse && problem.num_constraints() <= kFewConstraints;
  if (wanted == PropagatorKind::kContour || (wanted == PropagatorKind::kAuto && few)) {
    std::string why_no_contour;
    if (auto system = ContourSystem::Create(problem, options, why_no_contour, setups)) return Use(std::move(system));
    why_not += (why_not.empty() ? "" : "; ") + why_no_contour;
  }
  if (wanted == PropagatorKind::kSparseStepping) why_not = "sparse stepping is for time-stepping";
  if (wanted == PropagatorKind::kIterativeStepping) why_not = "iterative stepping is for time-stepping";
  if (wanted != PropagatorKind::kAuto) return Refuse("The chosen propagator cannot be used: " + why_not + ".");
  return DenseOrRefuse(problem, why_not);
}

namespace {

// Whether the methods that may be taken can use E as it is; the others need E⁻¹A.
bool KeepsMass(const Problem& problem, const Options& options) {
  const bool is_large = problem.num_states() > kSmallSparse;
  if (problem.A.is_dense() || !is_large || IsDiagonal(problem.E)) return false;
  switch (options.method) {
    case Method::kAuto:
    case Method::kTimeStepping:
      return StepsSparsely(problem, options) || options.propagator == PropagatorKind::kContour;
    case Method::kExponentialIntegrator:
    case Method::kLaplaceIteration:
      return options.propagator == PropagatorKind::kContour ||
             (options.propagator == PropagatorKind::kAuto && problem.num_constraints() <= kFewConstraints);
    default:
      return false;
  }
}

std::optional<Problem> WithSparseMatrices(const Problem& problem, const Options& options) {
  constexpr double kMostlyZero = 0.05;
  const auto is_mostly_zero = [](const StructuredMatrix& matrix) {
    return matrix.is_dense() && static_cast<double>((matrix.Dense().array() != 0).count()) <=
                                    kMostlyZero * static_cast<double>(matrix.size());
  };
  const bool is_left_open = options.method == Method::kAuto && options.propagator == PropagatorKind::kAuto;
  const bool is_large = problem.num_states() > kSmallSparse;
  if (!is_left_open || !is_large || !is_mostly_zero(problem.A)) return std::nullopt;
  Problem sparse = problem;
  for (StructuredMatrix* matrix : {&sparse.A, &sparse.B, &sparse.N, &sparse.M, &sparse.E}) {
    if (is_mostly_zero(*matrix)) *matrix = matrix->Sparse();
  }
  return sparse;
}

}  // namespace

std::optional<Problem> FormToSolve(const Problem& problem, const Options& options) {
  std::optional<Problem> sparse = WithSparseMatrices(problem, options);
  const Problem& form = sparse ? *sparse : problem;
  if (!form.has_mass() || KeepsMass(form, options)) return sparse;
  const bool is_affordable = form.num_states() <= kLargestDense || IsDiagonal(form.E);
  return is_affordable ? WithoutMass(form) : sparse;
}

}  // namespace dlcs
