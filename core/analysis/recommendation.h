// SPDX-License-Identifier: Apache-2.0
// How a problem should be solved: method, step, windows.

#ifndef DLCS_CORE_ANALYSIS_RECOMMENDATION_H_
#define DLCS_CORE_ANALYSIS_RECOMMENDATION_H_

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

// Following a recommendation is Solve(problem, options).
struct Recommendation {
  Options options;
  std::vector<std::string> reasons;   // a sentence each for the method, the step, and what else was set
  std::vector<std::string> warnings;  // what the trial solves found: jumps, an early end, a lost least element
  // Why no method can solve the problem on [0, T]; empty if one can. If it is set, the options solve up to the time
  // where the solution ends.
  std::string refusal;
  // The expected error of x with these options, relative to the largest value of each component; absent if the trials
  // do not show it.
  std::optional<double> predicted_error;
};

// Recommends options for the valid `problem`. Fields that `options` set already (method, step, any other) are kept. If
// neither steps nor an error are set, the error is Options::kDefaultErrorTolerance, as in a solve.
//
// If the recommended method is event_driven, or if steps or an error are set, the problem is solved once. Otherwise the
// cost is that of trial solves with 64, 128, 256, ... steps. If two of them differ by d and the observed order is p,
// the error of the finer one is d / (2^p - 1); the number of steps for the wanted error follows from it. Trials end
// when the error is reached or after about half a second. If the initial state is inconsistent, the trials project it,
// and a warning says so.
// Errors: InvalidArgument as Solve(). `stop` ends the trials.
absl::StatusOr<Recommendation> Recommend(const Problem& problem, const Options& options, std::stop_token stop);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_RECOMMENDATION_H_
