// SPDX-License-Identifier: Apache-2.0

#include "core/driver/step_control.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "core/context/sizes.h"
#include "core/driver/source_resolution.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// If a trial fails with more steps than this, the length of its steps is not the reason.
constexpr Index kMaxFailingSteps = 16384;
// Beyond this number of steps the solver gives up a tolerance that is out of reach.
constexpr Index kHopelessSteps = 16384;

bool FailsForAnyStep(Termination termination) {
  switch (termination) {
    case Termination::kInconsistentState:
    case Termination::kUnsupported:
    case Termination::kCancelled:
    case Termination::kNotSolved:
    case Termination::kNotPeriodic:
      return true;
    case Termination::kReachedEnd:
    case Termination::kInfeasible:
    case Termination::kDiverged:
    case Termination::kIterationLimit:
    case Termination::kNonFinite:
      return false;
  }
  return true;
}

Grid Refine(const Grid& grid, Index nodes_kept) {
  Grid fine = Halve(grid);
  if (fine.num_steps() <= nodes_kept) {
    fine.output_nodes.resize(fine.times.size());
    std::iota(fine.output_nodes.begin(), fine.output_nodes.end(), Index{0});
  }
  return fine;
}

// Two grids that agree to the last bit where x' is far from the system within a step: neither has seen what is there,
// such as a jump that all their nodes are on the same sides of.
bool AgreesByChance(double difference, const Solution& fine, double tolerance) {
  const Certificate& seen = fine.certificate;
  return difference == 0 && seen.ode_defect * fine.step > tolerance * seen.x_scale;
}

// Whether the steps in which pairs switch change x by so much that agreeing on their place is no proof.
bool MayPlaceSwitchesAlike(const TrialSolves& trials, const Solution& fine, const Options& options) {
  if (!trials.at_switches) return false;
  const ComponentValues sizes = trials.sizes(fine), rounding = trials.rounding_of_terms(sizes);
  const ComponentValues changes = Beyond(trials.at_switches(fine, sizes), rounding);
  return ExcessOfTruncation(ErrorsOf(sizes, changes, rounding), options, options.error_tolerance) > 1;
}

// Whether the bounds of `control` leave a place for `grid`.
bool IsAllowed(const StepControl& control, const TrialSolves& trials, const Grid& grid, Index steps_so_far) {
  const Index next = 2 * grid.num_steps();
  if (next > control.most_steps) return false;
  if (control.most_steps_all > 0 && steps_so_far + next > control.most_steps_all) return false;
  return !trials.fits || trials.fits(grid);
}

}  // namespace

ComponentValues WithRoundingOfRows(ComponentValues of_data, const ComponentValues& of_terms) {
  of_data.y = of_data.y.cwiseMax(of_terms.y);
  of_data.w = of_data.w.cwiseMax(of_terms.w);
  return of_data;
}

namespace {

// A sequence of trials.
class Trials {
 public:
  Trials(const StepControl& control, const TrialSolves& solves)
      : control_(control), solves_(solves), convergence_(control.expected_order) {}

  const Convergence& convergence() const { return convergence_; }

  // A failed trial gives no information, and neither do the trials before it.
  void StartAnew() {
    coarse_.reset();
    convergence_ = Convergence(control_.expected_order);
  }

  absl::Status Compare(const Grid& grid, Solution& fine) {
    const ComponentValues sizes = solves_.sizes(fine);
    if (absl::Status status = LookAtRounding(grid, fine, sizes); !status.ok()) return status;
    if (coarse_) {
      ComponentValues differences = Beyond(solves_.compare(*coarse_, fine, sizes), rounding_);
      const double relative = differences.LargestRelative(sizes);
      convergence_.Add(std::move(differences), relative);
    }
    Accuracy& accuracy = fine.accuracy;
    accuracy.source = AccuracySource::kControlled;
    accuracy.tolerance = control_.options.error_tolerance;
    if (convergence_.empty()) return absl::OkStatus();
    accuracy.errors = ErrorsOf(sizes, convergence_.errors(kSafety), rounding_);
    solves_.follow_states(fine, accuracy.errors);
    return absl::OkStatus();
  }

  // Raises the error of `fine` to what a solve with steps three times as long shows.
  void CountCheck(const Solution& check, Solution& fine) const {
    if (check.termination != Termination::kReachedEnd) return;
    const ComponentValues sizes = solves_.sizes(fine);
    ComponentValues differences = Beyond(solves_.compare(check, fine, sizes), rounding_);
    differences *= kSafety / (std::pow(3, convergence_.order()) - 1);
    const TrajectoryErrors errors = ErrorsOf(sizes, differences, rounding_);
    for (const ComponentKind kind : kComponentKinds) {
      Vector& truncation = fine.accuracy.errors.of(kind).truncation;
      truncation = NanMax(truncation, errors.of(kind).truncation);
    }
  }

  void Remember(Solution fine) { coarse_ = std::move(fine); }

 private:
  // At the first trial, so that what is rounding is known from the start, and at the first one that is accurate.
  absl::Status LookAtRounding(const Grid& grid, const Solution& fine, const ComponentValues& sizes) {
    constexpr double kResolved = 1e-3;
    const bool is_first = rounding_.x.size() == 0;
    if (is_first) rounding_ = solves_.rounding_of_terms(sizes);
    const bool is_accurate = !convergence_.empty() && convergence_.relative_error() <= kResolved;
    if (!solves_.solve_rounded || looked_when_accurate_ || !(is_first || is_accurate)) return absl::OkStatus();
    looked_when_accurate_ = is_accurate;
    const absl::StatusOr<Solution> rounded = solves_.solve_rounded(grid, kRoundedUlps);
    if (!rounded.ok()) return rounded.status();
    if (rounded->termination == Termination::kReachedEnd) {
      rounding_ = WithRoundingOfRows(solves_.compare(*rounded, fine, sizes), solves_.rounding_of_terms(sizes));
    }
    return absl::OkStatus();
  }

  const StepControl& control_;
  const TrialSolves& solves_;
  Convergence convergence_;
  ComponentValues rounding_;
  bool looked_when_accurate_ = false;
  std::optional<Solution> coarse_;  // the trial before
};

}  // namespace

void Convergence::Add(ComponentValues differences, double relative) {
  constexpr std::size_t kRemembered = 3;
  if (differences_.size() == kRemembered) differences_.erase(differences_.begin());
  differences_.push_back({std::move(differences), relative});
}

std::optional<double> Convergence::observed_order() const {
  const bool differ = std::ranges::all_of(differences_, [](const Difference& at) { return at.relative > 0; });
  return differ && differences_.size() >= 2 ? std::optional(order()) : std::nullopt;
}

double Convergence::order() const {
  double order = expected_;
  for (std::size_t k = 1; k < differences_.size(); ++k) {
    const double before = differences_[k - 1].relative, after = differences_[k].relative;
    if (!(before > 0 && after > 0)) return std::min(1.0, expected_);
    order = std::min(order, std::log2(before / after));
  }
  return differences_.size() < 2 ? std::min(1.0, expected_) : std::max(0.5, order);
}

ComponentValues Convergence::errors(double safety) const {
  const double rate = std::exp2(order());
  ComponentValues errors = differences_.back().of_components;
  double power = 1;
  for (auto before = differences_.rbegin() + 1; before != differences_.rend(); ++before) {
    power *= rate;
    errors.RaiseTo(before->of_components, 1 / power);
  }
  errors *= safety / (rate - 1);
  return errors;
}

double Convergence::relative_error(double safety) const {
  const double rate = std::exp2(order());
  double error = 0, power = 1;
  for (auto difference = differences_.rbegin(); difference != differences_.rend(); ++difference) {
    error = NanMax(error, difference->relative / power);
    power *= rate;
  }
  return error * safety / (rate - 1);
}

absl::StatusOr<ControlledSolution> SolveToTolerance(const StepControl& control, Grid grid, const TrialSolves& trials) {
  ControlledSolution result;
  Trials so_far(control, trials);
  const Convergence& convergence = so_far.convergence();
  Index steps_so_far = 0;
  while (true) {
    absl::StatusOr<Solution> fine = trials.solve(grid);
    if (!fine.ok()) return fine.status();
    steps_so_far += grid.num_steps();
    const bool solved = fine->termination == Termination::kReachedEnd;
    result.solution = *std::move(fine);
    result.grid = grid;
    if (!solved) {
      const Termination termination = result.solution.termination;
      const bool diverges = control.whole_horizon &&
                            (termination == Termination::kDiverged || termination == Termination::kIterationLimit);
      if (diverges || FailsForAnyStep(termination) || grid.num_steps() > kMaxFailingSteps) return result;
      so_far.StartAnew();
      if (!IsAllowed(control, trials, grid, steps_so_far)) return result;
    } else {
      Solution& solution = result.solution;
      if (absl::Status status = so_far.Compare(grid, solution); !status.ok()) return status;
      CountUnresolved(trials.unresolved(grid, solution), solution);
      const double tolerance = control.options.error_tolerance;
      const auto excess_of = [&] { return ExcessOfTruncation(solution.accuracy.errors, control.options, tolerance); };
      double excess = convergence.empty() ? std::numeric_limits<double>::quiet_NaN() : excess_of();
      result.order = convergence.observed_order();
      result.converges =
          convergence.shows_order() && !AgreesByChance(convergence.last_difference(), solution, tolerance);
      result.reached = result.converges && excess <= 1;
      if (result.reached && MayPlaceSwitchesAlike(trials, solution, control.options)) {
        const Grid longer = WithOtherSteps(grid, 3, control.nodes_kept);
        const absl::StatusOr<Solution> check = trials.solve(longer);
        if (!check.ok()) return check.status();
        steps_so_far += longer.num_steps();
        so_far.CountCheck(*check, solution);
        excess = excess_of();
        result.reached = excess <= 1;
      }
      const double least_steps = static_cast<double>(grid.num_steps()) * std::pow(excess, 1 / control.expected_order);
      const bool hopeless =
          grid.num_steps() >= kHopelessSteps && least_steps > 8.0 * static_cast<double>(control.most_steps);
      if (result.reached || hopeless) return result;
      if (!IsAllowed(control, trials, grid, steps_so_far)) return result;
      so_far.Remember(std::move(solution));
    }
    grid = Refine(grid, control.nodes_kept);
  }
}

}  // namespace dlcs
