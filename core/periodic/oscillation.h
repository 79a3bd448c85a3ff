// SPDX-License-Identifier: Apache-2.0
// Where a solution returns to: the first guess of an oscillation whose period is not known.

#ifndef DLCS_CORE_PERIODIC_OSCILLATION_H_
#define DLCS_CORE_PERIODIC_OSCILLATION_H_

#include <string>
#include <variant>

#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// What varies by less than this part of the size of every state is an equilibrium.
inline constexpr double kAtRest = 1e-6;

struct Oscillation {
  Vector state;       // a state to which the solution returns, nearly
  Vector y;           // there, as BranchAt() has it
  double period = 0;  // after this time
};

// Looks for an oscillation in the second half of `solution`, which has pieces up to `horizon`. The section is a value
// between the largest and the smallest one of the state that varies most relative to its size; the period is the time
// between the last crossing upwards and the one before it at which all states come nearest to the same values, and of
// several within the error of the solution the last one. A sentence where there is none: the state comes to rest, or
// the solution is shorter than two periods.
std::variant<Oscillation, std::string> FindOscillation(const Solution& solution, double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_PERIODIC_OSCILLATION_H_
