// SPDX-License-Identifier: Apache-2.0
// Equivalent forms of a system: their solution follows from that of the original, without any reference.

#ifndef DLCS_TESTS_HOSTILE_TRANSFORMS_H_
#define DLCS_TESTS_HOSTILE_TRANSFORMS_H_

#include <vector>

#include "tests/hostile/system.h"

namespace dlcs::hostile {

// Each x_i, y_i, w_i and the time, each times its unit (> 0), written into the data. By powers of two nothing is
// rounded.
struct UnitChange {
  Eigen::VectorXd states, y, w;
  double time = 1;
};
UnitChange NoUnitChange(const System& system);
System Rescaled(System system, const UnitChange& units);

// `count` random factors from 10^-decades to 10^decades.
Eigen::VectorXd RandomUnits(Random& random, int count, double decades, bool powers_of_two);

// The states in the order `states`, the pairs in the order `pairs`: entry i of the new system is entry order[i] of the
// old one.
System Permuted(const System& system, const std::vector<int>& states, const std::vector<int>& pairs);

// With `count` states that nothing drives but themselves and that start at 0, as numbers of `size`; they would drive
// the others.
System WithUnreachableStates(const System& system, int count, double size, Random& random);
// With `count` states that the others drive, and that drive none, in units of `size`.
System WithUnobservableStates(const System& system, int count, double size, Random& random);

// Both systems, side by side, over the horizon of the first. Their functions of time are listed one after the other,
// the pieces of the second on those of the first: neither may have pieces of its own.
System Joined(const System& first, const System& second);

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_TRANSFORMS_H_
