// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/recommendation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/driver/error_control.h"
#include "core/driver/plan.h"
#include "core/driver/step_control.h"
#include "core/format_number.h"
#include "core/problem/solution.h"
#include "core/solve.h"

namespace dlcs {
namespace {

constexpr Index kFirstTrial = 64;
constexpr Index kMaxSteps = Index{1} << 22;  // that trials for a tolerance take
constexpr double kTrialSeconds = 0.5;

// The options of a trial: x at the kFirstTrial + 1 times that are nodes of every trial.
Options TrialOptions(const Options& options, const Problem& problem, Index steps) {
  Options trial = options;
  trial.num_steps = steps;
  trial.step = 0;
  trial.estimate_error = false;
  trial.output_times_only = true;
  trial.output_times.clear();
  for (Index k = 0; k <= kFirstTrial; ++k) {
    trial.output_times.push_back(problem.horizon * static_cast<double>(k) / static_cast<double>(kFirstTrial));
  }
  return trial;
}

// The results of trials with 64, 128, 256, ... steps.
struct Trials {
  Index finest = 0;  // steps of the finest that reached the end
  Convergence convergence;
};

// Predicts from the trials how many steps the tolerance requires.
void PredictSteps(const Trials& trials, Recommendation& recommendation) {
  const double tolerance = recommendation.options.error_tolerance;
  if (trials.convergence.empty()) return;
  const double error = trials.convergence.relative_error(kSafety);
  const double order = trials.convergence.order();
  const double wanted = static_cast<double>(trials.finest) * std::max(1.0, std::pow(error / tolerance, 1 / order));
  recommendation.predicted_error = std::min(error, tolerance);
  recommendation.reasons.push_back(
      "An error of " + FormatNumber(tolerance) + " should take about " + FormatNumber(wanted) + " steps: trials with " +
      std::to_string(trials.finest / 2) + " and " + std::to_string(trials.finest) + " differ by " +
      FormatNumber(trials.convergence.last_difference()) + " of the size of x, and the observed order is " +
      FormatNumber(std::round(10 * order) / 10) + ".");
  if (wanted <= static_cast<double>(kMaxSteps)) return;
  recommendation.warnings.push_back("That is more than the trials allow: allow a larger error, or set steps.");
}

void KeepNew(const std::vector<std::string>& found, std::vector<std::string>& kept) {
  for (const std::string& text : found) {
    if (std::find(kept.begin(), kept.end(), text) == kept.end()) kept.push_back(text);
  }
}

}  // namespace

absl::StatusOr<Recommendation> Recommend(const Problem& problem, const Options& options, std::stop_token stop) {
  Recommendation recommendation;
  recommendation.options = options;
  const bool is_default = options.method != Method::kEventDriven && FillInDefaultError(recommendation.options);
  const auto plan = MakePlan(problem, recommendation.options, nullptr);
  if (!plan.ok()) return plan.status();
  const bool tries_steps = is_default && !plan->is_refused() && plan->method.method != Method::kEventDriven;
  Observer silent;
  Trials trials;
  Solution last;
  Solution previous;
  double spent = 0;
  for (Index steps = kFirstTrial; !stop.stop_requested(); steps *= 2) {
    Options trial = tries_steps ? TrialOptions(options, problem, steps) : options;
    trial.project_initial_state = recommendation.options.project_initial_state;
    auto solution = Solve(problem, trial, silent, stop);
    if (!solution.ok()) return solution.status();
    if (solution->termination == Termination::kInconsistentState && !recommendation.options.project_initial_state) {
      recommendation.options.project_initial_state = true;
      recommendation.warnings.push_back(solution->message);
      recommendation.reasons.push_back("The state must jump first: the options allow it.");
      steps /= 2;
      continue;
    }
    last = *std::move(solution);
    if (!tries_steps || last.termination == Termination::kUnsupported || last.termination == Termination::kCancelled)
      break;
    spent += last.cost.seconds_total;
    if (last.termination == Termination::kReachedEnd) {
      if (trials.finest > 0) {
        const ComponentValues sizes = SizesOf(problem, last, /*y_counts=*/false);
        ComponentValues differences =
            Beyond(DifferencesBetween(previous, last, sizes), RoundingOfTerms(problem, sizes));
        const double relative = differences.LargestRelative(sizes);
        trials.convergence.Add(std::move(differences), relative);
      }
      trials.finest = steps;
      previous = last;
    }
    const bool accurate = trials.convergence.shows_order() &&
                          trials.convergence.relative_error(kSafety) <= recommendation.options.error_tolerance;
    if (accurate || spent + 2 * last.cost.seconds_total > kTrialSeconds || steps >= kMaxSteps) break;
  }

  // If the method is left open, the solve chooses the same one again.
  if (!is_default) recommendation.options.method = last.method;
  if (!last.reason.empty()) recommendation.reasons.insert(recommendation.reasons.begin(), last.reason + ".");
  KeepNew(last.warnings, recommendation.warnings);
  if (last.termination != Termination::kReachedEnd && last.termination != Termination::kCancelled) {
    recommendation.refusal = last.message;
  }
  if (tries_steps) {
    PredictSteps(trials, recommendation);
  } else if (!std::isnan(last.accuracy.error)) {
    recommendation.predicted_error = last.accuracy.error;
    if (last.accuracy.source == AccuracySource::kControlled) {
      recommendation.reasons.push_back("It takes " + std::to_string(last.cost.steps) +
                                       " steps; the error of x should be about " + FormatNumber(last.accuracy.error) +
                                       " of its size.");
    }
  }
  return recommendation;
}

}  // namespace dlcs
