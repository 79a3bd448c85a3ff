// SPDX-License-Identifier: Apache-2.0
// What is known about a problem before it is solved, and how it should be solved.

#ifndef DLCS_CORE_ANALYZE_H_
#define DLCS_CORE_ANALYZE_H_

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/analysis/findings.h"
#include "core/analysis/recommendation.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

struct Analysis {
  Index num_states = 0;
  Index num_constraints = 0;
  double horizon = 0;
  std::string matrix_class;  // of M, as text: "P-matrix (all principal minors positive)"
  std::string rule;          // the solution that is meant, as text: "least element (M is a Z-matrix)"
  std::vector<AnalysisSection> sections;
  Recommendation recommendation;
  std::vector<std::string> warnings;  // those of the sections and of the recommendation
  double seconds = 0;
};

// Analyzes `problem`. The bounds are stated for the step, tolerance and method that `options` set. Solves LCPs at
// single times, small linear programs, and the trials of Recommend(). Errors: InvalidArgument as Solve(). `stop` is
// checked as in Solve(); a stopped analysis holds the finished sections and a warning.
absl::StatusOr<Analysis> Analyze(const Problem& problem, const Options& options, std::stop_token stop);

// The same for a problem and options in which Validate() has found nothing: it is not called again.
absl::StatusOr<Analysis> AnalyzeValidated(const Problem& problem, const Options& options, std::stop_token stop);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYZE_H_
