// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/mpi_steps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/context/checkpointing.h"
#include "core/context/consistency.h"
#include "core/lcp/structured/bounded_solver.h"
#include "core/mpi/distributed_krylov.h"
#include "core/mpi/distributed_operator.h"
#include "core/mpi/halo.h"
#include "core/mpi/ownership.h"
#include "core/mpi/part_of_problem.h"
#include "core/mpi/row_exchange.h"
#include "core/stepping/iterative_step.h"
#include "core/stepping/iterative_stepper.h"
#include "core/stepping/stepping.h"

namespace dlcs {
namespace {

// Steps of the rows of this rank. Smooth intervals start with the whole problem.
class MpiStepper final : public SegmentStepper {
 public:
  MpiStepper(std::unique_ptr<IterativeStepper> stepper, SolveContext& whole, const Ownership& states,
             const Ownership& pairs, MpiTeam& team)
      : stepper_(std::move(stepper)), whole_(whole), states_(states), pairs_(pairs), team_(team) {}

  const Scheme& scheme() const override { return stepper_->scheme(); }
  Index lcps_of_a_step() const override { return stepper_->lcps_of_a_step(); }
  Index least_steps() const override { return stepper_->least_steps(); }
  LcpStatus TakeSteps(Segment& segment, const std::stop_token& stop, SelectionStats& departures,
                      Index& solved) override {
    return stepper_->TakeSteps(segment, stop, departures, solved);
  }

  bool StartInterval(SolveContext& /*context*/, double time, const Eigen::Ref<const Vector>& g, Eigen::Ref<Vector> x,
                     Eigen::Ref<Vector> y, bool& y_is_solution) override {
    Vector whole_x = Collect(x, states_, team_), whole_y = Collect(y, pairs_, team_);
    const Vector whole_g = Collect(g, pairs_, team_);
    if (!dlcs::StartInterval(whole_, time, whole_g, whole_x, whole_y, y_is_solution)) return false;
    const auto take = [this](const Vector& whole, const Ownership& owners, Eigen::Ref<Vector> own) {
      Index i = 0;
      for (const Index row : owners.rows(team_.rank())) own[i++] = whole[row];
    };
    take(whole_x, states_, x);
    take(whole_y, pairs_, y);
    return true;
  }

 private:
  const std::unique_ptr<IterativeStepper> stepper_;
  SolveContext& whole_;
  const Ownership &states_, &pairs_;
  MpiTeam& team_;
};

// The unknowns of K: in each rank its states, then the y of its pairs that are no obstacles.
class UnknownsOfRanks {
 public:
  UnknownsOfRanks(const Ownership& states, const RowsOfPairs& own, const RowMajorMatrix& own_B, const Ownership& pairs,
                  MpiTeam& team)
      : states_(states), pairs_(pairs), rank_(team.rank()), halo_(OutsidePairs(own, own_B, pairs, rank_), pairs, team) {
    Index next = states.count(rank_);
    own_.resize(own.count());
    for (Index i = 0; i < own.count(); ++i) own_[i] = own.IsObstacle(i) ? -1 : static_cast<double>(next++);
    halo_.Exchange(own_, outside_);
    std::vector<Index> sizes;
    for (const double size : team.Gather(static_cast<double>(next))) sizes.push_back(static_cast<Index>(size));
    ownership_.emplace(Ownership::BlocksOf(sizes));
  }

  const Ownership& ownership() const { return *ownership_; }
  UnknownNumbers numbers() const {
    return {.count = ownership_->size(),
            .of_state = [this](Index state) { return ownership_->first(states_.owner(state)) + states_.local(state); },
            .of_pair = [this](Index pair) { return OfPair(pair); }};
  }

 private:
  static std::vector<Index> OutsidePairs(const RowsOfPairs& own, const RowMajorMatrix& own_B, const Ownership& pairs,
                                         int rank) {
    std::vector<Index> outside;
    for (const RowMajorMatrix* matrix : {&own_B, &own.M}) {
      for (Index k = 0; k < matrix->nonZeros(); ++k) {
        if (const Index pair = matrix->innerIndexPtr()[k]; pairs.owner(pair) != rank) outside.push_back(pair);
      }
    }
    return outside;
  }
  Index OfPair(Index pair) const {
    const int owner = pairs_.owner(pair);
    const double local = owner == rank_ ? own_[pairs_.local(pair)] : outside_(halo_.PlaceOf(pair, pairs_), 0);
    return local < 0 ? -1 : ownership_->first(owner) + static_cast<Index>(local);
  }

  const Ownership &states_, &pairs_;
  const int rank_;
  const Halo halo_;
  Vector own_;      // places of own pairs among the unknowns of this rank; -1 for obstacles
  Matrix outside_;  // the same of others, in those of theirs
  std::optional<Ownership> ownership_;
};

// S of all states; empty without a mass matrix.
Vector ScalesOfStates(const RowsOfStates& rows, const Ownership& states, MpiTeam& team) {
  if (rows.E.rows() == 0) return Vector();
  Vector own(rows.E.rows());
  for (Index i = 0; i < own.size(); ++i) {
    own[i] = 1 / std::sqrt(rows.E.coeff(i, rows.numbers[static_cast<std::size_t>(i)]));
  }
  return Collect(own, states, team);
}

// The part of this rank of the sparse system of one step, with its solver.
std::unique_ptr<IterativeStep> PartOfStep(const PartOfProblem& part, double step, SparseRule rule, double theta,
                                          const Ownership& states, const Ownership& pairs, Workers& workers,
                                          MpiTeam& team, double tolerance) {
  const StepRule step_rule(part.problem(), step, rule, theta);
  std::unique_ptr<const RowsOfStates> rows(new RowsOfStates(part.States()));  // make_unique() would copy them
  const UnknownsOfRanks of_ranks(states, part.pairs(), rows->B, pairs, team);
  const Ownership& unknowns = of_ranks.ownership();
  IterativeSystem system =
      AssembleRows(step_rule, *rows, part.pairs(), ScalesOfStates(*rows, states, team), of_ranks.numbers());
  rows.reset();
  const bool is_symmetric = [&] {
    const RowMajorMatrix transpose = Transposed(system.K, unknowns.rows(team.rank()), unknowns.size(), unknowns, team);
    if (team.Any(!DifferByRounding(system.K, transpose))) return false;
    system.K = (system.K + transpose) / 2;
    return true;
  }();
  for (double* norm :
       {&system.norm_of_states, &system.norm_of_coupling, &system.norm_of_pairs, &system.norm_of_pair_states}) {
    *norm = team.Max(*norm);
  }
  const Index first = unknowns.first(team.rank());
  std::vector<BoundedUnknown> bounded;
  Vector diagonal(part.pairs().count());
  for (IterativeSystem::Pair& pair : system.pairs) {
    const Index number = pair.unknown;
    pair.unknown -= first;
    diagonal[static_cast<Index>(bounded.size())] = system.K.coeff(pair.unknown, number);
    bounded.push_back(pair.bound());
  }
  std::optional<DistributedRows> K;
  K.emplace(system.K, unknowns, team);
  RowMajorMatrix().swap(system.K);
  auto linear = std::make_unique<DistributedKrylov>(*K, unknowns, is_symmetric, workers, team);
  K.reset();
  auto solver = std::make_unique<BoundedSolver>(std::move(linear), std::move(diagonal), std::move(bounded), workers);
  return std::make_unique<IterativeStep>(step_rule, std::move(system), std::move(solver), team, tolerance);
}

// Of all rows from those of each rank.
Certificate Together(const Certificate& part, MpiTeam& team) {
  Certificate whole;
  const auto largest = [&](double Certificate::*value) { whole.*value = team.Max(part.*value); };
  largest(&Certificate::node_residual);
  largest(&Certificate::midpoint_residual);
  largest(&Certificate::node_complementarity);
  largest(&Certificate::midpoint_complementarity);
  largest(&Certificate::ode_defect);
  largest(&Certificate::lcp_scale);
  largest(&Certificate::ode_scale);
  largest(&Certificate::x_scale);
  largest(&Certificate::node_residual_of_rows);
  largest(&Certificate::midpoint_residual_of_rows);
  largest(&Certificate::drift_of_rows);
  return whole;
}

// The left limits of all ranks, merged. A rank without one at a time has its values from the right there.
std::vector<LeftLimit> CollectLeftLimits(const Solution& part, const Ownership& pairs, MpiTeam& team) {
  std::vector<LeftLimit> limits;
  std::size_t next = 0;
  const auto none = static_cast<double>(part.times.size());
  const auto column_of = [&](std::size_t k) {
    return k < part.left_limits.size() ? static_cast<double>(part.left_limits[k].column) : none;
  };
  for (;;) {
    const double column = -team.Max(-column_of(next));  // the first that a rank has
    if (column >= none) return limits;
    const auto k = static_cast<Index>(column);
    const bool is_own = column_of(next) == column;
    const Vector y = is_own ? part.left_limits[next].y : Vector(part.y.col(k));
    const Vector w = is_own ? part.left_limits[next].w : Vector(part.w.col(k));
    if (is_own) ++next;
    limits.push_back({k, Collect(y, pairs, team), Collect(w, pairs, team)});
  }
}

// Adds what the ranks have found to the solution of the whole. Where `kept` is not null, the trajectory goes there.
void Conclude(SolveContext& part, const Ownership& states, const Ownership& pairs, MpiTeam& team, SolveContext& whole,
              std::optional<TrajectoryParts>* kept) {
  const Index recorded = part.recorder.recorded();
  part.recorder.Finish();
  Solution& solution = whole.solution;
  const Solution& of_rank = part.solution;
  std::copy(of_rank.times.begin(), of_rank.times.end(), solution.times.begin());
  std::vector<LeftLimit> left_limits = CollectLeftLimits(of_rank, pairs, team);
  if (kept) {
    // The trajectory stays on the ranks, so the caller cannot look for values that are not finite.
    const bool is_finite = of_rank.x.allFinite() && of_rank.y.allFinite() && of_rank.w.allFinite();
    if (team.Any(!is_finite) && of_rank.termination == Termination::kNotSolved) {
      part.Fail(Termination::kNonFinite, whole.problem.horizon, "The trajectory holds a number that is not finite.");
    }
    for (Matrix* values : {&solution.x, &solution.y, &solution.w}) values->resize(0, values->cols());
    kept->emplace(TrajectoryParts{states, pairs, std::move(part.solution.x), std::move(part.solution.y),
                                  std::move(part.solution.w), std::move(left_limits)});
  } else {
    solution.x.leftCols(recorded) = Collect(of_rank.x, states, team);
    solution.y.leftCols(recorded) = Collect(of_rank.y, pairs, team);
    solution.w.leftCols(recorded) = Collect(of_rank.w, pairs, team);
    solution.left_limits = std::move(left_limits);
  }
  whole.recorder.ResumeFrom(recorded);
  if (!part.certificate.empty()) whole.certificate.Replace(Together(part.certificate.certificate(), team));
  solution.dense_output = of_rank.dense_output;
  solution.warnings.insert(solution.warnings.end(), of_rank.warnings.begin(), of_rank.warnings.end());
  solution.cost.steps += of_rank.cost.steps;
  solution.cost.lcps += of_rank.cost.lcps;
  solution.cost.seconds_setup += of_rank.cost.seconds_setup;
  solution.cost.seconds_lcp += of_rank.cost.seconds_lcp;
  if (of_rank.termination != Termination::kNotSolved) {
    whole.Fail(of_rank.termination, of_rank.failure_time, of_rank.message);
  }
  const double impulse = -team.Max(-part.impulses.first.value_or(std::numeric_limits<double>::infinity()));
  if (impulse <= whole.problem.horizon) whole.impulses.first = impulse;
}

// Combines the checkpoints of the ranks, which all make them at the same place, into one of the whole solve. Passes on
// all other reports.
class CheckpointsOfAll final : public Observer {
 public:
  CheckpointsOfAll(SolveContext& whole, IterativeAccount& account, const Ownership& states, const Ownership& pairs,
                   MpiTeam& team)
      : whole_(whole), account_(account), states_(states), pairs_(pairs), team_(team) {}

  // Sets the whole to the state that it resumes from, if there is one, and `point` to that of the rows of this rank.
  // Returns false if the state does not belong to this solve.
  bool Resume(ResumePoint& point) {
    if (!ResumeFromCheckpoint(whole_, [this](StateArchive& state) { Carry(state); })) return false;
    if (!whole_.checkpoints.resume) return true;
    const auto rank = static_cast<std::size_t>(team_.rank());
    if (parts_.size() != static_cast<std::size_t>(team_.size())) {
      return whole_.Fail(Termination::kUnsupported, 0, "The checkpoint is one of another number of ranks.");
    }
    point.state = std::move(parts_[rank]);
    parts_.clear();
    const Index recorded = whole_.recorder.recorded();
    point.x = whole_.solution.x.leftCols(recorded)(states_.rows(team_.rank()), Eigen::all);
    point.y = whole_.solution.y.leftCols(recorded)(pairs_.rows(team_.rank()), Eigen::all);
    point.w = whole_.solution.w.leftCols(recorded)(pairs_.rows(team_.rank()), Eigen::all);
    return true;
  }

  void MakeFrom(const SolveContext& part) { part_ = &part; }

  void OnWindowStarted(const WindowReport& report) override { whole_.observer.OnWindowStarted(report); }
  void OnWindowFinished(const WindowOutcome& outcome) override { whole_.observer.OnWindowFinished(outcome); }
  bool WantsCheckpoint() override { return whole_.observer.WantsCheckpoint(); }
  void OnCheckpoint(const Checkpoint& part) override {
    const Index recorded = part_->recorder.recorded(), count = recorded - part.first;  // the last may still change
    Solution& solution = whole_.solution;
    std::copy_n(part.solution.times.begin() + part.first, count, solution.times.begin() + part.first);
    solution.x.middleCols(part.first, count) = Collect(part.solution.x.middleCols(part.first, count), states_, team_);
    solution.y.middleCols(part.first, count) = Collect(part.solution.y.middleCols(part.first, count), pairs_, team_);
    solution.w.middleCols(part.first, count) = Collect(part.solution.w.middleCols(part.first, count), pairs_, team_);
    solution.left_limits = CollectLeftLimits(part.solution, pairs_, team_);
    whole_.recorder.ResumeFrom(recorded);
    parts_ = team_.CollectTexts(part.state());
    OfferCheckpoint(whole_, part.time, [this](StateArchive& state) { Carry(state); });
    parts_.clear();
  }

 private:
  void Carry(StateArchive& state) {
    state(parts_, account_.linear_iterations, account_.set_changes, account_.direct_steps);
  }

  SolveContext& whole_;
  IterativeAccount& account_;
  const Ownership &states_, &pairs_;
  MpiTeam& team_;
  const SolveContext* part_ = nullptr;
  std::vector<std::string> parts_;  // the state of each rank, while one of the whole is written or read
};

std::vector<Index> LocalRows(const std::vector<Index>& rows, const Ownership& owners, int rank) {
  std::vector<Index> local;
  for (const Index row : rows) {
    if (owners.owner(row) == rank) local.push_back(owners.local(row));
  }
  return local;
}

}  // namespace

std::string MpiSteps::WhyNot(const Problem& problem) {
  const Ownership states = Ownership::Blocks(problem.num_states(), team_.size());
  if (problem.has_mass()) {
    const RowMajorMatrix E = RowsOf(problem.E, states, team_);
    bool is_positive = true;
    for (Index i = 0; i < E.rows(); ++i) is_positive = is_positive && E.coeff(i, states.first(team_.rank()) + i) > 0;
    if (team_.Any(!is_positive)) return IterativeStep::kNoPositiveMass;
  }
  const Ownership pairs = PairsByStates(problem, states, team_);
  const UnservedPair own = FindUnserved(PairsOfRank(problem, states, pairs, team_), states.size());
  // The first one of all ranks.
  const std::vector<double> rules = team_.Gather(static_cast<double>(own.rule));
  const std::vector<double> at_pairs = team_.Gather(static_cast<double>(own.pair));
  const std::vector<double> at_states = team_.Gather(static_cast<double>(own.state));
  UnservedPair first;
  for (std::size_t rank = 0; rank < rules.size(); ++rank) {
    const auto of_rank = static_cast<UnservedPair::Rule>(rules[rank]);
    const auto pair = static_cast<Index>(at_pairs[rank]);
    if (of_rank == UnservedPair::Rule::kNone) continue;
    if (first.rule != UnservedPair::Rule::kNone && first.pair < pair) continue;
    first = {of_rank, pair, static_cast<Index>(at_states[rank])};
  }
  return first.Text();
}

bool MpiSteps::Take(SolveContext& context, SparseRule rule, IterativeAccount& account) {
  const Problem& problem = context.problem;
  if (problem.num_states() < team_.size()) {
    return context.Fail(Termination::kUnsupported, 0,
                        "There are fewer states than ranks, and iterative steps give each rank some.");
  }
  const Ownership states = Ownership::Blocks(problem.num_states(), team_.size());
  const Ownership pairs = PairsByStates(problem, states, team_);
  const PartOfProblem part_of_rank(problem, states, pairs, team_);
  const Problem& part = part_of_rank.problem();
  auto sources = Sources::Create(part);
  if (!sources.ok()) {
    return context.Fail(Termination::kUnsupported, 0, std::string(sources.status().message()));
  }
  Index most_states = 0, most_pairs = 0;
  for (int rank = 0; rank < team_.size(); ++rank) {
    most_states = std::max(most_states, states.count(rank));
    most_pairs = std::max(most_pairs, pairs.count(rank));
  }
  CheckpointsOfAll checkpoints(context, account, states, pairs, team_);
  ResumePoint point;
  if (!checkpoints.Resume(point)) return false;
  Solution solution;
  solution.method = context.solution.method;
  solution.propagator.used = context.solution.propagator.used;
  SolveContext of_rank{.problem = part,
                       .options = context.options,
                       .matrix_class = context.matrix_class,
                       .selection = context.selection,
                       .grid = context.grid,
                       .sources = *std::move(sources),
                       .workers = context.workers,
                       .observer = checkpoints,
                       .stop = context.stop,
                       .started = context.started,
                       .recorder = Recorder(context.grid, part.num_states(), part.num_constraints(), solution),
                       .certificate = CertificateBuilder(part, team_),
                       .solution = solution,
                       .checkpoints = {.resume = context.checkpoints.resume ? &point : nullptr, .makes = true},
                       .impulses = {.rows = LocalRows(context.impulses.rows, pairs, team_.rank())}};
  checkpoints.MakeFrom(of_rank);
  of_rank.distribution.emplace(SolveContext::Distribution{team_, most_states, most_pairs});
  const double tolerance = IterativeStep::ToleranceFor(context.options, context.grid.num_steps());
  const auto make_stepper = [&](double step, Progress& progress) {
    auto iterative =
        PartOfStep(part_of_rank, step, rule, context.options.theta, states, pairs, context.workers, team_, tolerance);
    auto stepper = std::make_unique<IterativeStepper>(
        std::move(iterative), [] { return nullptr; }, context.grid, account, progress);
    return std::make_unique<MpiStepper>(std::move(stepper), context, states, pairs, team_);
  };
  const bool reached_end = StepThroughGrid(of_rank, make_stepper);
  Conclude(of_rank, states, pairs, team_, context, keeps_trajectories_ ? &trajectory_ : nullptr);
  return reached_end && solution.termination == Termination::kNotSolved;
}

}  // namespace dlcs
