// SPDX-License-Identifier: Apache-2.0
// A differential linear complementarity system
//
//     x'(t) = A x + B y + f(t),   0 <= y ⟂ w = N x + g(t) + M y >= 0,   x(0) = x0,   t in [0, T],
//
// or E x'(t) = A x + B y + f(t) with a nonsingular mass matrix E.

#ifndef DLCS_CORE_PROBLEM_PROBLEM_H_
#define DLCS_CORE_PROBLEM_PROBLEM_H_

#include <optional>
#include <string>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/problem/outputs.h"
#include "core/problem/solution_rule.h"
#include "core/problem/switching.h"
#include "core/problem/time_function.h"
#include "core/types.h"

namespace dlcs {

struct Problem {
  StructuredMatrix A;                // m × m
  StructuredMatrix B;                // m × n
  StructuredMatrix N;                // n × m
  StructuredMatrix M;                // n × n
  TimeFunction f;                    // m components
  TimeFunction g;                    // n components
  Vector x0;                         // m
  double horizon = 0;                // T > 0
  std::vector<double> break_points;  // further times in (0, T) where f or g jumps or has a kink
  SolutionRule rule = SolutionRule::kAuto;
  std::optional<Selector> selector;  // with kMinimizer, and only then
  std::optional<Vector> y0;  // with kHistory, and only then: n entries >= 0; the first solution has y_i > 0 where
                             // these are positive, if there is one
  StructuredMatrix E = {};   // m × m, nonsingular; 0 × 0 stands for the identity
  Outputs outputs = {};
  std::vector<Measurement> measurements = {};
  Switching switching = {};

  bool has_mass() const { return E.rows() > 0; }
  // E times the columns.
  Matrix MassTimes(const Matrix& columns) const { return has_mass() ? Matrix(E * columns) : columns; }
  Index num_states() const { return A.rows(); }
  Index num_constraints() const { return M.rows(); }
};

// Every rule that `problem` breaks, in the order of the fields above; empty if it is valid. Checks shapes (m is the
// number of rows of A, n of M, neither 0), non-finite entries, T > 0, times out of order or outside (0, T), and
// formulas that do not parse, a singular E, outputs and measurements (core/problem/outputs.h). If all this is right, it
// also checks for formulas with a pole or without a finite value in [0, T], for more than kMaxSwitchingTimes switching
// times, and for components of f, g and h without a finite value at one of 257 equidistant times or on one side of a
// break point (naming the first such time).
//
// Fields are named A B N M f g x0 T break_points selector.C selector.b E, with [row][column] or [component],
// those inside f and g as core/problem/time_function.h says. At most 200 are listed; one more entry counts the rest.
// Cost: that of AnalyzeFormulas(), 257 values of every component, and a factorization of E.
std::vector<Violation> Validate(const Problem& problem);

// The break points of the valid `problem`: those that it declares and those of f, g, h of the outputs and their
// formulas, merged by MergeBreakPoints().
std::vector<double> BreakPoints(const Problem& problem);
TimeAxis AxisOf(const Problem& problem);
// The warnings of the search for switching times of f, g and h, with field and formula.
std::vector<std::string> SourceWarnings(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_PROBLEM_H_
