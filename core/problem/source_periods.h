// SPDX-License-Identifier: Apache-2.0
// Whether the sources of a problem repeat, and the problem of one period.

#ifndef DLCS_CORE_PROBLEM_SOURCE_PERIODS_H_
#define DLCS_CORE_PROBLEM_SOURCE_PERIODS_H_

#include <optional>
#include <vector>

#include "core/problem/formula_tree.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// The smallest known period of a formula in t, from some time on: of (t > 1)*sin(2*t) it is pi. 0 if the formula is
// constant from some time on; absent if it is not periodic, or its parts have periods without a common multiple. A
// period may be a multiple of the smallest one.
std::optional<double> PeriodOf(const FormulaTree& tree);

// The rules of Options::period: no other method than event_driven; a positive period that f and g repeat after, at
// least from a small multiple of it on; with kFindPeriod sources that do not depend on time. Each violation names
// "period", and describes the source and, if it is known, its period. Nothing is checked without a period.
//
// Formulas and constants are defined for all times. A source made of samples, polynomials or several pieces is known up
// to T alone: it must cover two periods, or T must be the period, and then it is one period of the source. Two values
// one period apart may differ by 1e-8 of the largest, which a period with ten digits needs.
std::vector<Violation> CheckPeriod(const Problem& problem, const Options& options);

// The problem on one period, from the first multiple of the period on from which the sources repeat.
struct OnePeriod {
  Problem problem;
  double phase = 0;  // that time; mostly 0
};
// For a `period` that passed CheckPeriod().
OnePeriod ProblemOfOnePeriod(const Problem& problem, double period);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_SOURCE_PERIODS_H_
