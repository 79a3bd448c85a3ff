// SPDX-License-Identifier: Apache-2.0
// The nonlinear dynamic complementarity problem (5.1) of [Wu & Chen],
//
//     x'(t) = f(t, x, y),   0 <= y ⟂ g(t, x, y) >= 0,   x(0) = x0,   t in [0, T].

#ifndef DLCS_CORE_PROBLEM_NONLINEAR_PROBLEM_H_
#define DLCS_CORE_PROBLEM_NONLINEAR_PROBLEM_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/problem/formula_parameters.h"
#include "core/problem/options.h"
#include "core/types.h"

namespace dlcs {

// The components of f and g are formulas in t, x1 ... xm, y1 ... yn (core/problem/formula.h).
struct NonlinearProblem {
  std::vector<std::string> f;        // m formulas
  std::vector<std::string> g;        // n formulas
  Vector x0;                         // m
  double horizon = 0;                // T > 0
  std::vector<double> break_points;  // times in (0, T) where f or g jumps or has a kink in t
  // The matrix of the splitting (5.2), m × m; zero gives the iteration of Picard. Absent: chosen from the
  // Jacobians of f and g at the start of each window (core/nonlinear/splitting_iteration.h).
  std::optional<Matrix> W;
  FormulaParameters parameters = {};  // named numbers in the formulas

  Index num_states() const { return x0.size(); }
  Index num_constraints() const { return static_cast<Index>(g.size()); }
};

// Every rule that `problem` breaks, in the order of the fields; empty if it is valid. m is the number of entries of x0,
// n the number of formulas in g, neither 0. Fields are named f[i] g[i] x0 T break_points W[i][j] parameters.NAME.
// Formulas are not evaluated: the solve reports where one has no finite value.
std::vector<Violation> Validate(const NonlinearProblem& problem);

// The break points of the valid `problem` and the switching times of those parts of its formulas that depend on t
// alone, merged as for a linear problem (core/problem/problem.h).
std::vector<double> BreakPoints(const NonlinearProblem& problem);
// The warnings of the search for these switching times.
std::vector<std::string> SourceWarnings(const NonlinearProblem& problem);

// OK, or InvalidArgument with every violation of problem and options ("field: description", one per line).
absl::Status CheckValid(const NonlinearProblem& problem, const Options& options);
// Options that only linear problems have: a period, and methods other than kAuto and kLaplaceIteration.
std::vector<Violation> CheckOptions(const NonlinearProblem& problem, const Options& options);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_NONLINEAR_PROBLEM_H_
