// SPDX-License-Identifier: Apache-2.0

#include "core/methods/step_control.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// A trial that fails with more steps than this does not fail because they are long.
constexpr Index kMostFailingSteps = 16384;
// Beyond these many steps a tolerance that is out of reach is given up.
constexpr Index kHopelessSteps = 16384;

bool FailsForAnyStep(Termination termination) {
  switch (termination) {
    case Termination::kInconsistentState:
    case Termination::kUnsupported:
    case Termination::kCancelled:
    case Termination::kNotSolved:
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

// The larger of two, entry by entry; NaN where one is.
Vector Largest(const Vector& a, const Vector& b) {
  return a.binaryExpr(b, [](double p, double q) { return NanMax(p, q); });
}

// Two grids that agree to the last bit where x' is far from the system within a step: neither has seen what is there,
// such as a jump that all their nodes are on the same sides of.
bool AgreesByChance(double difference, const Solution& fine, double tolerance) {
  const Certificate& seen = fine.certificate;
  return difference == 0 && seen.ode_defect * fine.step > tolerance * seen.x_scale;
}

// Whether the bounds of `control` leave a place for `grid`.
bool IsAllowed(const StepControl& control, const TrialSolves& trials, const Grid& grid, Index steps_so_far) {
  const Index next = 2 * grid.num_steps();
  if (next > control.most_steps) return false;
  if (control.most_steps_all > 0 && steps_so_far + next > control.most_steps_all) return false;
  return !trials.fits || trials.fits(grid);
}

void SetAccuracy(const Convergence& convergence, double tolerance, Accuracy& accuracy) {
  accuracy.source = AccuracySource::kControlled;
  accuracy.asked = tolerance;
  if (convergence.empty()) return;
  ComponentErrors errors = convergence.errors(kSafety);
  accuracy.error = NanMax(errors.largest(), Accuracy::kLeastError);
  accuracy.errors_x = std::move(errors.x);
  accuracy.errors_By = std::move(errors.By);
}

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
    errors.x = Largest(errors.x, before->x / power);
    errors.By = Largest(errors.By, before->By / power);
  }
  errors.x *= safety / (rate - 1);
  errors.By *= safety / (rate - 1);
  return errors;
}

absl::StatusOr<ControlledSolution> SolveToTolerance(const StepControl& control, Grid grid, const TrialSolves& trials) {
  ControlledSolution result;
  std::optional<Solution> coarse;
  Convergence convergence(control.expected_order);
  Index steps_so_far = 0;
  while (true) {
    absl::StatusOr<Solution> fine = trials.solve(grid);
    if (!fine.ok()) return fine.status();
    steps_so_far += grid.num_steps();
    const bool solved = fine->termination == Termination::kReachedEnd;
    if (solved && coarse) convergence.Add(trials.compare(*coarse, *fine));
    result.solution = *std::move(fine);
    if (!solved) {
      const Termination termination = result.solution.termination;
      const bool diverges = control.whole_horizon && (termination == Termination::kDiverged ||
                                                      termination == Termination::kIterationLimit);
      if (diverges || FailsForAnyStep(termination) || grid.num_steps() > kMostFailingSteps) return result;
      coarse.reset();
      convergence = Convergence(control.expected_order);
      if (!IsAllowed(control, trials, grid, steps_so_far)) return result;
    } else {
      SetAccuracy(convergence, control.tolerance, result.solution.accuracy);
      const double error = result.solution.accuracy.error;
      if (!convergence.empty()) result.order = convergence.order();
      result.reached = convergence.shows_order() && error <= control.tolerance &&
                       !AgreesByChance(convergence.last_difference(), result.solution, control.tolerance);
      const double least_steps =
          static_cast<double>(grid.num_steps()) * std::pow(error / control.tolerance, 1 / control.expected_order);
      const bool hopeless =
          grid.num_steps() >= kHopelessSteps && least_steps > 8.0 * static_cast<double>(control.most_steps);
      if (result.reached || hopeless) return result;
      if (!IsAllowed(control, trials, grid, steps_so_far)) return result;
      coarse = std::move(result.solution);
    }
    grid = Refine(grid, control.nodes_kept);
  }
}

}  // namespace dlcs
