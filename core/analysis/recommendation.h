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
  std::vector<std::string> warnings;  // what the trial solves met: jumps, an early end, a lost least element
  // Why the problem cannot be solved on [0, T] by anything here; empty when it can. The options then reach as far as
  // there is a solution.
  std::string refusal;
  // The error in x that following it is expected to have, relative to the largest value of each component; absent where
  // nothing shows it.
  std::optional<double> predicted_error;
};

// Recommends options for `problem` (sound), keeping what `options` set already: method, step and all else. Where
// neither steps nor an error are set it is what a solve does by itself: Options::kDefaultErrorTolerance.
//
// Where event location serves, and where something is set, the problem is solved once. Elsewhere the cost comes from
// trial solves with 64, 128, 256, ... steps: where two of them differ by d and the order seen is p, the finer errs by d
// / (2^p - 1), and the number of steps for the error follows. Trials end when it is reached or their time (about half a
// second) is used up. An inconsistent start is taken with its jump, and that is said.
// Errors: InvalidArgument as Solve(). `stop` ends the trials.
absl::StatusOr<Recommendation> Recommend(const Problem& problem, const Options& options, std::stop_token stop);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_RECOMMENDATION_H_
