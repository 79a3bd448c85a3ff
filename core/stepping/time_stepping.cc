// SPDX-License-Identifier: Apache-2.0

#include "core/stepping/time_stepping.h"

#include <algorithm>

#include "core/context/shared_setup.h"
#include "core/stepping/distributed_steps.h"
#include "core/stepping/iterative_account.h"
#include "core/stepping/iterative_stepper.h"
#include "core/stepping/newton_bounds.h"
#include "core/stepping/stepping.h"

namespace dlcs {
namespace {

void WarnOfLongStep(const Problem& problem, const std::optional<double>& kappa, double step,
                    std::vector<std::string>& warnings) {
  const std::string what = "Newton's method is not guaranteed to converge for h = " + FormatNumber(step) + ": ";
  if (!kappa) {
    warnings.push_back(what + "no bound of κ = ‖A‖ + 𝓛‖B‖‖N‖ is known for this M (n = " +
                       std::to_string(problem.num_constraints()) + ").");
  } else if (3 * step * *kappa >= 1) {
    warnings.push_back(
        what + "Theorem 3.2 of [Chen & Xiang 2013] requires h < 1/(3κ) = " + FormatNumber(1 / (3 * *kappa)) + ".");
  }
}

void Report(const NewtonAccount& account, const SolveContext& context, const std::optional<double>& kappa) {
  Solution& solution = context.solution;
  Cost& cost = solution.cost;
  cost.lcps += account.lcps + account.substituted_steps;
  cost.newton_iterations = account.iterations;
  cost.most_newton_iterations = std::max<Index>(1, account.residuals.size()) - 1;
  cost.substituted_steps = account.substituted_steps;
  solution.newton = {
      .time = context.grid.times[account.hardest_node], .residuals = account.residuals, .contraction = std::nullopt};
  if (kappa) solution.newton->contraction = *kappa * context.grid.longest_step;
  if (account.substituted_steps > 0) {
    solution.warnings.push_back(std::to_string(account.substituted_steps) +
                                " steps were solved by substitution, because Newton's method did not converge.");
  }
}

std::string SchemeName(const Options& options) {
  return options.average_y ? "averaged" : "theta " + NumberText(options.theta);
}

SparseRule RuleOf(const Options& options, bool two_stages) {
  if (two_stages) return SparseRule::kTwoStages;
  return options.average_y ? SparseRule::kAveraged : SparseRule::kTheta;
}

std::unique_ptr<Stepper> SparseStepper(SolveContext& context, double step) {
  ++context.solution.propagator.factorizations;
  auto sparse = TimeSteppingStep(context.problem, context.options, context.choices.two_stages, step);
  auto solver = SharedCoupledSolver(context, sparse->CoupledTerm());
  return std::make_unique<Stepper>(context.problem, std::move(sparse), context.choice(), std::move(solver));
}

// Whether the dense matrices of a direct step fit, and factors of A that fill as those of a grid in space.
bool FitsDirectStep(const SolveContext& context) {
  constexpr Index kLargestFactors = 500'000'000;
  const auto m = static_cast<double>(context.problem.num_states());
  const auto n = static_cast<double>(context.problem.num_constraints());
  return sizeof(double) * (4 * n * n + m * n) + static_cast<double>(kLargestFactors) <= context.options.max_memory &&
         m <= 100'000;
}

bool StepIteratively(SolveContext& context) {
  const Problem& problem = context.problem;
  IterativeAccount account;
  const double tolerance = IterativeStep::ToleranceFor(context.options, context.grid.num_steps());
  const auto make_stepper = [&](double step, Progress& progress) {
    auto iterative = std::make_unique<IterativeStep>(problem, step, RuleOf(context.options, context.choices.two_stages),
                                                     context.options.theta, context.workers, tolerance);
    const auto make_direct = [&context, step] {
      return FitsDirectStep(context) ? SparseStepper(context, step) : nullptr;
    };
    return std::make_unique<IterativeStepper>(std::move(iterative), make_direct, context.grid, account, progress);
  };
  DistributedSteps* const distributed = Team::Current().distributed_steps();
  const bool reached_end =
      distributed ? distributed->Take(context, RuleOf(context.options, context.choices.two_stages), account)
                  : StepThroughGrid(context, make_stepper);
  context.solution.propagator.linear_iterations = account.linear_iterations;
  context.solution.propagator.set_changes = account.set_changes;
  if (account.direct_steps > 0) {
    context.solution.warnings.push_back(std::to_string(account.direct_steps) +
                                        " steps were solved with sparse factors, because the iteration did not find "
                                        "their active set.");
  }
  return reached_end;
}

bool StepByNewton(SolveContext& context, const SchemeFactory& make_scheme) {
  const std::optional<double> kappa = RightHandSideLipschitz(context.problem, context.matrix_class.lipschitz);
  WarnOfLongStep(context.problem, kappa, context.grid.longest_step, context.solution.warnings);
  NewtonAccount account;
  const bool reached_end = StepThroughGrid(context, SchemeName(context.options), make_scheme, &account);
  Report(account, context, kappa);
  return reached_end;
}

}  // namespace

bool StepsSparsely(const Problem& problem, const Options& options) {
  // Below, products with dense matrices of size m are as fast as solves with sparse factors.
  constexpr Index kSmall = 200;
  if (options.step_solver == StepSolver::kNewton || options.inelastic_impact) return false;
  if (options.propagator != PropagatorKind::kAuto) {
    return options.propagator == PropagatorKind::kSparseStepping ||
           options.propagator == PropagatorKind::kIterativeStepping;
  }
  return !problem.A.is_dense() && problem.num_states() > kSmall;
}

Scheme TimeSteppingScheme(const Problem& problem, const Options& options, double step) {
  return options.average_y ? AveragedScheme(problem, step) : ThetaScheme(problem, step, options.theta);
}

std::unique_ptr<const SparseStep> TimeSteppingStep(const Problem& problem, const Options& options, bool two_stages,
                                                   double step) {
  Workers workers(options.num_threads);
  return std::make_unique<const SparseStep>(problem, step, RuleOf(options, two_stages), options.theta, workers);
}

Matrix CoupledStepMatrix(const Problem& problem, const Options& options, bool two_stages, double step) {
  if (StepsSparsely(problem, options)) {
    return problem.M.Dense() + TimeSteppingStep(problem, options, two_stages, step)->CoupledTerm();
  }
  return problem.M.Dense() + problem.N * TimeSteppingScheme(problem, options, step).y_after;
}

bool TimeStepping(SolveContext& context) {
  if (context.solution.propagator.used == PropagatorKind::kIterativeStepping) return StepIteratively(context);
  if (StepsSparsely(context.problem, context.options)) {
    return StepThroughGrid(context, [&](double step, Progress&) { return SparseStepper(context, step); });
  }
  const auto make_scheme = [&](double step) { return TimeSteppingScheme(context.problem, context.options, step); };
  if (context.options.step_solver == StepSolver::kNewton) return StepByNewton(context, make_scheme);
  return StepThroughGrid(context, SchemeName(context.options), make_scheme);
}

}  // namespace dlcs
