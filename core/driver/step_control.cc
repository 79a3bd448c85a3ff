// SPDX-License-Identifier: Apache-2.0

#include "core/driver/step_control.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

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
bool MayPlaceSwitchesAlike(const TrialSolves& trials, const Solution& fine, double tolerance) {
  return trials.at_switches && trials.at_switches(fine).largest() > tolerance;
}

// Whether the bounds of `control` leave a place for `grid`.
bool IsAllowed(const StepControl& control, const TrialSolves& trials, const Grid& grid, Index steps_so_far) {
  const Index next = 2 * grid.num_steps();
  if (next > control.most_steps) return false;
  if (control.most_steps_all > 0 && steps_so_far + next > control.most_steps_all) return false;
  return !trials.fits || trials.fits(grid);
}

// A sequence of trials.
class Trials {
 public:
  Trials(const StepControl& control, const TrialSolves& solves)
      : control_(control), solves_(solves), convergence_(control.expected_order) {}

  const Convergence& convergence() const { return convergence_; }
  double rounding() const { return rounding_ ? rounding_->largest() : 0; }

  // A failed trial gives no information, and neither do the trials before it.
  void StartAnew() {
    coarse_.reset();
    convergence_ = Convergence(control_.expected_order);
  }

  absl::Status Compare(Solution& fine) {
    if (coarse_) convergence_.Add(solves_.compare(*coarse_, fine));
    if (absl::Status status = LookAtRounding(); !status.ok()) return status;
    Accuracy& accuracy = fine.accuracy;
    accuracy.source = AccuracySource::kControlled;
    accuracy.tolerance = control_.tolerance;
    if (convergence_.empty()) return absl::OkStatus();
    ComponentErrors errors = convergence_.errors(kSafety);
    if (rounding_) errors += *rounding_;
    errors.MoveTo(accuracy);
    return absl::OkStatus();
  }

  // Raises the error of `fine` to what a solve with steps three times as long shows.
  void CountCheck(const Solution& check, Solution& fine) const {
    if (check.termination != Termination::kReachedEnd) return;
    ComponentErrors errors = solves_.compare(check, fine);
    errors *= kSafety / (std::pow(3, convergence_.order()) - 1);
    if (!(errors.largest() <= fine.accuracy.error)) errors.MoveTo(fine.accuracy);
  }

  void Remember(Solution fine, const Grid& grid) {
    coarse_ = std::move(fine);
    grid_ = grid;
  }

 private:
  absl::Status LookAtRounding() {
    constexpr double kResolved = 1e-3;
    if (rounding_ || !solves_.solve_rounded || convergence_.empty()) return absl::OkStatus();
    if (!(convergence_.errors().largest() <= std::max(control_.tolerance, kResolved))) return absl::OkStatus();
    const absl::StatusOr<Solution> rounded = solves_.solve_rounded(grid_, kRoundedUlps);
    if (!rounded.ok()) return rounded.status();
    if (rounded->termination == Termination::kReachedEnd) rounding_ = solves_.compare(*rounded, *coarse_);
    return absl::OkStatus();
  }

  const StepControl& control_;
  const TrialSolves& solves_;
  Convergence convergence_;
  std::optional<ComponentErrors> rounding_;
  std::optional<Solution> coarse_;  // the trial before, on grid_
  Grid grid_;
};

}  // namespace

void Convergence::Add(ComponentErrors differences) {
  constexpr std::size_t kRemembered = 3;
  if (differences_.size() == kRemembered) differences_.erase(differences_.begin());
  differences_.push_back(std::move(differences));
}

double Convergence::order() const {
  double order = expected_;
  for (std::size_t k = 1; k < differences_.size(); ++k) {
    const double before = differences_[k - 1].largest(), after = differences_[k].largest();
    if (!(before > 0 && after > 0)) return std::min(1.0, expected_);
    order = std::min(order, std::log2(before / after));
  }
  return differences_.size() < 2 ? std::min(1.0, expected_) : std::max(0.5, order);
}

ComponentErrors Convergence::errors(double safety) const {
  const double rate = std::exp2(order());
  ComponentErrors errors = differences_.back();
  double power = 1;
  for (auto before = differences_.rbegin() + 1; before != differences_.rend(); ++before) {
    power *= rate;
    errors.RaiseTo(*before, 1 / power);
  }
  errors *= safety / (rate - 1);
  return errors;
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
    if (!solved) {
      const Termination termination = result.solution.termination;
      const bool diverges = control.whole_horizon &&
                            (termination == Termination::kDiverged || termination == Termination::kIterationLimit);
      if (diverges || FailsForAnyStep(termination) || grid.num_steps() > kMaxFailingSteps) return result;
      so_far.StartAnew();
      if (!IsAllowed(control, trials, grid, steps_so_far)) return result;
    } else {
      if (absl::Status status = so_far.Compare(result.solution); !status.ok()) return status;
      CountUnresolved(trials.unresolved(grid, result.solution), result.solution);
      double error = result.solution.accuracy.error;
      result.rounding = so_far.rounding();
      if (!convergence.empty()) result.order = convergence.order();
      result.reached = convergence.shows_order() && error <= control.tolerance &&
                       !AgreesByChance(convergence.last_difference(), result.solution, control.tolerance);
      if (result.reached && MayPlaceSwitchesAlike(trials, result.solution, control.tolerance)) {
        const Grid longer = WithOtherSteps(grid, 3, control.nodes_kept);
        const absl::StatusOr<Solution> check = trials.solve(longer);
        if (!check.ok()) return check.status();
        steps_so_far += longer.num_steps();
        so_far.CountCheck(*check, result.solution);
        error = result.solution.accuracy.error;
        result.reached = error <= control.tolerance;
      }
      const double least_steps =
          static_cast<double>(grid.num_steps()) * std::pow(error / control.tolerance, 1 / control.expected_order);
      const bool hopeless =
          result.rounding > control.tolerance ||
          (grid.num_steps() >= kHopelessSteps && least_steps > 8.0 * static_cast<double>(control.most_steps));
      if (result.reached || hopeless) return result;
      if (!IsAllowed(control, trials, grid, steps_so_far)) return result;
      so_far.Remember(std::move(result.solution), grid);
    }
    grid = Refine(grid, control.nodes_kept);
  }
}

}  // namespace dlcs
