// SPDX-License-Identifier: Apache-2.0
#include "core/recommendation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/methods/step_control.h"
#include "core/number_text.h"
#include "core/solution.h"
#include "core/solve.h"

namespace dlcs {
namespace {

constexpr Index kFirstTrial = 64;
constexpr Index kLargestRecommendation = 10'000'000;
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

// 1, 2 or 5 times a power of ten, at least `steps`.
Index RoundNumberOfSteps(double steps) {
  const double power = std::pow(10, std::floor(std::log10(steps)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= steps * (1 - 1e-9)) return static_cast<Index>(std::llround(digit * power));
  }
  return static_cast<Index>(std::llround(10 * power));
}

// What trials with 64, 128, 256, ... steps have shown.
struct Trials {
  Index finest = 0;  // steps of the finest that reached the end
  Convergence convergence;
};

void RecommendStep(const Trials& trials, Recommendation& recommendation) {
  Options& options = recommendation.options;
  if (trials.convergence.empty()) {
    options.num_steps = trials.finest > 0 ? Options::kDefaultSteps : 0;
    return;
  }
  const double error = trials.convergence.error();
  const double wanted = static_cast<double>(trials.finest) *
                        std::pow(error / kRecommendedAccuracy, 1 / trials.convergence.order());
  const double steps =
      std::clamp(wanted, static_cast<double>(trials.finest) / 2, static_cast<double>(kLargestRecommendation));
  options.num_steps = RoundNumberOfSteps(steps);
  recommendation.predicted_error =
      error * std::pow(static_cast<double>(trials.finest) / static_cast<double>(options.num_steps),
                       trials.convergence.order());
  std::string reason =
      std::to_string(options.num_steps) + " steps: trials with " + std::to_string(trials.finest / 2) +
      " and " + std::to_string(trials.finest) + " differ by " +
      FormatNumber(trials.convergence.last_difference()) + " of the size of x, the order seen is " +
      FormatNumber(std::round(10 * trials.convergence.order()) / 10) +
      ", so the error in x should be about " + FormatNumber(*recommendation.predicted_error) + " of its size";
  if (static_cast<double>(options.num_steps) > 10.0 * static_cast<double>(trials.finest)) {
    reason += " (extrapolated: check it with the error estimate)";
  }
  recommendation.reasons.push_back(std::move(reason) + ".");
  if (wanted > static_cast<double>(kLargestRecommendation)) {
    recommendation.warnings.push_back("An accuracy of " + FormatNumber(kRecommendedAccuracy) +
                                      " would take about " + FormatNumber(wanted) + " steps.");
  }
}

void KeepNew(const std::vector<std::string>& found, std::vector<std::string>& kept) {
  for (const std::string& text : found) {
    if (std::find(kept.begin(), kept.end(), text) == kept.end()) kept.push_back(text);
  }
}

}  // namespace

absl::StatusOr<Recommendation> Recommend(const Problem& problem, const Options& options,
                                         std::stop_token stop) {
  Recommendation recommendation;
  recommendation.options = options;
  const bool controls_steps = options.error_tolerance > 0 || options.method == Method::kEventLocated;
  const bool has_step = options.has_grid() || controls_steps;
  Observer silent;
  Trials trials;
  Solution last;
  Matrix previous_x;
  double spent = 0;
  for (Index steps = kFirstTrial; !stop.stop_requested(); steps *= 2) {
    Options trial = has_step ? options : TrialOptions(recommendation.options, problem, steps);
    trial.project_initial_state = recommendation.options.project_initial_state;
    auto solution = Solve(problem, trial, silent, stop);
    if (!solution.ok()) return solution.status();
    if (solution->termination == Termination::kInconsistentState &&
        !recommendation.options.project_initial_state) {
      recommendation.options.project_initial_state = true;
      recommendation.warnings.push_back(solution->message);
      recommendation.reasons.push_back("The state must jump first: the jump is asked for.");
      steps /= 2;
      continue;
    }
    last = *std::move(solution);
    spent += last.cost.seconds_total;
    const bool solved = last.termination == Termination::kReachedEnd;
    if (solved) {
      if (trials.finest > 0 && previous_x.cols() == last.x.cols()) {
        trials.convergence.Add(RelativeDifference(previous_x, last.x));
      }
      trials.finest = steps;
      previous_x = last.x;
    }
    if (has_step || last.termination == Termination::kUnsupported ||
        last.termination == Termination::kCancelled)
      break;
    const bool accurate =
        trials.convergence.shows_order() && trials.convergence.error() <= kRecommendedAccuracy;
    if (accurate || spent + 2 * last.cost.seconds_total > kTrialSeconds || steps >= kLargestRecommendation)
      break;
  }

  recommendation.options.method = last.method;
  if (!last.reason.empty()) recommendation.reasons.insert(recommendation.reasons.begin(), last.reason + ".");
  KeepNew(last.warnings, recommendation.warnings);
  if (last.termination != Termination::kReachedEnd && last.termination != Termination::kCancelled) {
    recommendation.refusal = last.message;
  }
  if (!has_step) RecommendStep(trials, recommendation);
  if (controls_steps && !std::isnan(last.accuracy.error)) {
    recommendation.predicted_error = last.accuracy.error;
    recommendation.reasons.push_back("Its error in x should be about " + FormatNumber(*recommendation.predicted_error) +
                                     " of its size.");
  }
  return recommendation;
}

}  // namespace dlcs
