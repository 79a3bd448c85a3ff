// SPDX-License-Identifier: Apache-2.0

#include "core/stepping/stepping.h"

#include <algorithm>
#include <vector>

#include "core/context/checkpointing.h"
#include "core/context/consistency.h"
#include "core/context/shared_setup.h"
#include "core/discretization/step_cache.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// Steps between two sums of the certificate. Its columns stay in the cache, or fill 4 MB each; where A is dense, its
// products take some ten milliseconds, since they are not interrupted. Iterative steps start from the ones before them
// in the same stretch, so theirs may be four times as long.
Index Chunk(const SolveContext& context) {
  const Problem& problem = context.problem;
  const bool is_dense = problem.A.is_dense();
  const bool iterates = context.solution.propagator.used == PropagatorKind::kIterativeStepping;
  const Index m = context.most_states(), n = context.most_pairs();
  const Index operations = n * n + (is_dense ? m * m : m);
  const Index numbers = is_dense || iterates ? kMostNumbersOfALargeChunk : kMostNumbersOfAChunk;
  return std::clamp<Index>(std::min(numbers / m, (Index{1} << 23) / operations), is_dense ? 8 : 1, 256);
}

}  // namespace

bool SegmentStepper::StartInterval(SolveContext& context, double time, const Eigen::Ref<const Vector>& g,
                                   Eigen::Ref<Vector> x, Eigen::Ref<Vector> y, bool& y_is_solution) {
  return dlcs::StartInterval(context, time, g, x, y, y_is_solution);
}

void WarnOf(const SelectionStats& departures, SolveContext& context) {
  std::vector<std::string>& warnings = context.solution.warnings;
  const std::string rule = SelectionName(context.selection);
  const std::string steps = " of " + std::to_string(context.solution.cost.steps) + " steps ";
  if (departures.steps_off_selection > 0) {
    warnings.push_back("In " + std::to_string(departures.steps_off_selection) + steps +
                       "y solves the coupled LCP, but is not " + rule +
                       " of LCP(N x + g, M) at the new x; no such solution was found.");
  }
  if (departures.steps_with_ties > 0) {
    warnings.push_back("In " + std::to_string(departures.steps_with_ties) + steps + rule +
                       " is not unique: the one of least norm was taken.");
  }
}

Stepper::Stepper(const Problem& problem, Scheme scheme, const SolutionChoice& choice)
    : Stepper(problem, scheme, choice, MakeCoupledLcpSolver(problem.M, problem.N * scheme.y_after, choice)) {}

Stepper::Stepper(const Problem& problem, Scheme scheme, const SolutionChoice& choice, std::unique_ptr<LcpSolver> solver)
    : problem_(problem),
      abs_N_(problem.N.Dense().cwiseAbs()),
      scheme_(std::move(scheme)),
      choice_(choice),
      coupled_(std::move(solver), problem.num_constraints(), scheme_.y_is_linear),
      q_(problem.num_constraints()),
      size_(problem.num_constraints()) {}

Stepper::Stepper(const Problem& problem, std::unique_ptr<const SparseStep> sparse, const SolutionChoice& choice,
                 std::unique_ptr<LcpSolver> solver)
    : problem_(problem),
      sparse_(std::move(sparse)),
      scheme_(sparse_->Description()),
      choice_(choice),
      coupled_(std::move(solver), problem.num_constraints(), scheme_.y_is_linear),
      q_(problem.num_constraints()),
      size_(problem.num_constraints()) {}

void Stepper::StartWithSources(Segment& segment) const {
  if (sparse_) return sparse_->StartWithSources(segment);
  const Index steps = segment.steps;
  auto x = segment.x.rightCols(steps);
  x.noalias() = scheme_.f_after * segment.f.rightCols(steps);
  if (scheme_.f_before.size() > 0) x.noalias() += scheme_.f_before * segment.f.leftCols(steps);
}

void Stepper::AddBefore(Segment& segment, Index j) const {
  if (sparse_) return sparse_->AddBefore(segment, j, stage_);
  auto x = segment.x.col(j);
  x.noalias() += scheme_.state * segment.x.col(j - 1);
  if (scheme_.y_before.size() > 0) x.noalias() += scheme_.y_before * segment.y.col(j - 1);
}

void Stepper::AddAfter(Segment& segment, Index j) const {
  if (sparse_) return sparse_->AddAfter(segment, j);
  segment.x.col(j).noalias() += scheme_.y_after * segment.y.col(j);
}

LcpStatus Stepper::TakeSteps(Segment& segment, const std::stop_token& stop, SelectionStats& departures, Index& solved) {
  const Index steps = segment.steps;
  StartWithSources(segment);
  const Vector size_of_g = RowMaxAbs(segment.g);
  coupled_.StartFrom(segment.y.col(0));
  if (newton_) newton_->StartFrom(segment.y.col(0));

  solved = 0;
  try {
    for (; solved < steps && !stop.stop_requested(); ++solved) {
      const Index j = solved + 1;
      if (const LcpStatus verdict = TakeStage(segment, size_of_g, j, departures); verdict != LcpStatus::kSolved) {
        return verdict;
      }
      AddBefore(segment, j);
      if (newton_ && SolveByNewton(segment, size_of_g, j)) continue;
      const LcpStatus verdict = Substitute(segment, size_of_g, j, departures);
      if (verdict != LcpStatus::kSolved) return verdict;
    }
  } catch (const Stopped&) {
    // In the middle of a step: those before it are kept.
  }
  return LcpStatus::kSolved;
}

LcpStatus Stepper::TakeStage(const Segment& segment, const Vector& size_of_g, Index j, SelectionStats& departures) {
  if (!sparse_ || !sparse_->has_stage()) return LcpStatus::kSolved;
  sparse_->StartStage(segment, j, stage_);
  return Substitute(stage_, size_of_g, 1, departures);
}

LcpStatus Stepper::Substitute(Segment& segment, const Vector& size_of_g, Index j, SelectionStats& departures) {
  auto x = segment.x.col(j);
  auto y = segment.y.col(j);
  size_ = size_of_g;
  if (sparse_) {
    q_.setZero();
    sparse_->AddPairs(segment, j, q_, size_);
  } else {
    q_.noalias() = problem_.N.Dense() * x;
    size_.noalias() += abs_N_ * x.cwiseAbs();
  }
  q_ += segment.g.col(j);
  const LcpStatus verdict = coupled_.Solve(q_, size_, departures, y);
  if (verdict != LcpStatus::kSolved) return verdict;
  AddAfter(segment, j);
  return LcpStatus::kSolved;
}

void Stepper::UseNewton(NewtonAccount& account) {
  newton_.emplace(problem_, scheme_, choice_);
  account_ = &account;
}

bool Stepper::SolveByNewton(Segment& segment, const Vector& size_of_g, Index j) {
  u_ = segment.x.col(j - 1);
  const NewtonVerdict verdict = newton_->Solve(segment.x.col(j), segment.g.col(j), size_of_g, u_, segment.y.col(j));
  const Index iterations = newton_->iterations();
  account_->lcps += static_cast<Index>(newton_->residuals().size());
  account_->iterations += iterations;
  if (newton_->residuals().size() > account_->residuals.size()) {
    account_->residuals = newton_->residuals();
    account_->hardest_node = segment.first_node + j;
  }
  if (verdict != NewtonVerdict::kConverged) {
    ++account_->substituted_steps;
    return false;
  }
  segment.x.col(j) = u_;
  return true;
}

namespace {

void CarryFields(StateArchive& state, NewtonAccount& account) {
  state(account.iterations, account.lcps, account.substituted_steps, account.hardest_node, account.residuals);
}

bool StepThroughGrid(SolveContext& context, const StepperFactory& make_stepper, NewtonAccount* newton) {
  const Problem& problem = context.problem;
  const std::vector<Run>& runs = context.grid.runs;
  SelectionStats departures;
  Progress progress(context);
  StepCache<SegmentStepper> steppers([&](double step) { return make_stepper(step, progress); },
                                     MostStepsKept(problem.num_states()));
  Vector x = problem.x0;
  Vector y = Vector::Zero(problem.num_constraints());
  bool y_is_solution = false;
  std::size_t at = 0;  // the run, and the steps done of it
  Index done = 0;
  Segment segment;  // keeps its memory from stretch to stretch
  const auto carry = [&](StateArchive& state) {
    state(steppers, at, done, x, y, y_is_solution, departures.steps_off_selection, departures.steps_with_ties);
    if (newton) CarryFields(state, *newton);
  };
  if (!ResumeFromCheckpoint(context, carry)) return false;

  for (; at < runs.size(); ++at, done = 0) {
    const Run& run = runs[at];
    const double setup_begin = context.Seconds();
    SegmentStepper& stepper = steppers.At(run.step);
    context.solution.cost.seconds_setup += context.Seconds() - setup_begin;
    while (done < run.steps) {
      segment.first_y_is_solution = true;
      const Index steps = std::min(std::max(Chunk(context), stepper.least_steps()), run.steps - done);
      const auto bad = context.sources.Sample(context.grid, run, done, steps, segment);
      if (context.Any(bad.has_value())) {
        return context.FailNonFinite(bad.value_or(Sources::NonFinite{context.grid.times[segment.first_node],
                                                                     "f or g has no finite value in another process"}));
      }
      const double begin = context.grid.times[segment.first_node];
      if (context.stop.stop_requested()) return context.FailCancelled(begin);
      progress.At(begin);
      const bool starts_interval = done == 0 && run.starts_at_break;
      if (starts_interval && !stepper.StartInterval(context, begin, segment.g.col(0), x, y, y_is_solution)) {
        return false;
      }

      segment.x.resize(problem.num_states(), steps + 1);
      segment.y.resize(problem.num_constraints(), steps + 1);
      segment.x.col(0) = x;
      segment.y.col(0) = y;
      Index solved = 0;
      const double steps_begin = context.Seconds();
      const LcpStatus verdict = stepper.TakeSteps(segment, context.stop, departures, solved);
      context.solution.cost.seconds_lcp += context.Seconds() - steps_begin;
      if (!newton) context.solution.cost.lcps += solved * stepper.lcps_of_a_step();
      context.solution.cost.steps += solved;

      if (starts_interval && !y_is_solution) {
        segment.first_y_is_solution = false;
        if (solved > 0) segment.y.col(0) = segment.y.col(1);
      }
      const double next_time = context.grid.times[segment.first_node + std::min(solved + 1, steps)];
      if (solved < steps) segment.Truncate(solved);
      const double certificate_begin = context.Seconds();
      context.Add(segment, stepper.scheme());
      context.solution.cost.seconds_certificate += context.Seconds() - certificate_begin;
      if (verdict == LcpStatus::kSolved && solved < steps) return context.FailCancelled(next_time);
      if (departures.steps_off_selection > 0 && stepper.scheme().y_is_linear) {
        return context.FailLostLeastElement(next_time);
      }
      if (verdict != LcpStatus::kSolved) {
        return FailLcp(context, verdict, next_time, "The coupled step LCP(q, M + K_0)");
      }
      x = segment.x.col(steps);
      y = segment.y.col(steps);
      if (context.Any(!x.allFinite())) return FailLcp(context, LcpStatus::kNonFinite, next_time, "");
      done += steps;
      OfferCheckpoint(context, next_time, carry);
    }
  }
  progress.Finish(problem.horizon);
  WarnOf(departures, context);
  return true;
}

}  // namespace

Stepper MakeStepper(const SolveContext& context, const std::string& kind, double step,
                    const SchemeFactory& make_scheme) {
  Scheme scheme = SharedScheme(context, kind, step, make_scheme);
  auto solver = SharedCoupledSolver(context, context.problem.N * scheme.y_after);
  return Stepper(context.problem, std::move(scheme), context.choice(), std::move(solver));
}

bool StepThroughGrid(SolveContext& context, const std::string& kind, const SchemeFactory& make_scheme,
                     NewtonAccount* newton) {
  const auto make_stepper = [&](double step, Progress&) {
    std::unique_ptr<Stepper> stepper(new Stepper(MakeStepper(context, kind, step, make_scheme)));
    if (newton) stepper->UseNewton(*newton);
    return stepper;
  };
  return StepThroughGrid(context, make_stepper, newton);
}

bool StepThroughGrid(SolveContext& context, const StepperFactory& make_stepper) {
  return StepThroughGrid(context, make_stepper, nullptr);
}

}  // namespace dlcs
