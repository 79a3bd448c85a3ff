// SPDX-License-Identifier: Apache-2.0
// Conditions on controls as complementary pairs.

#ifndef DLCS_CORE_PROBLEM_CONDITION_PAIRS_H_
#define DLCS_CORE_PROBLEM_CONDITION_PAIRS_H_

#include <vector>

#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// The times in (0, T) at which something happens that no control decides, increasing.
std::vector<double> KnownTimesOf(const Problem& problem);

// The problem with a pair for each of ConditionsOf(), behind its own: 0 <= y_k ⟂ w_k = level - c + y_k >= 0, or with
// the other sign of c - level. Nothing depends on y_k, and k is active where the condition holds. So the search for
// modes says which conditions hold just behind a time, and an event is found where one begins or ends to hold. The
// known times become break points. H s is left out, as F s and G s are: the solve adds them. A problem with neither
// pairs nor conditions has one pair, y >= 0 ⟂ y + 1 >= 0.
Problem WithConditionPairs(const Problem& problem);

// Takes the pairs behind the first `n` out of the solution of such a problem.
void RemoveConditionPairs(Index n, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_CONDITION_PAIRS_H_
