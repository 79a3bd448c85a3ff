// SPDX-License-Identifier: Apache-2.0
// One plain system solved by the engine, and judged component by component against the reference.

#ifndef DLCS_TESTS_PLAIN_PLAIN_TRIAL_H_
#define DLCS_TESTS_PLAIN_PLAIN_TRIAL_H_

#include <string>

#include "core/problem/accuracy.h"
#include "tests/hostile/trial.h"
#include "tests/plain/plain_system.h"

namespace dlcs::plain {

struct PlainTrial {
  hostile::Judgment judgment = hostile::Judgment::kNotJudged;
  // The component that is worst beside what it is allowed; of a refusal without need the worst that the engine missed.
  std::string component;
  double error = 0, own = 0, allowed = 0, time = 0;
  bool an_ulp_decides = false;  // a refusal is needed for this alone
  bool has_rough_zero = false;  // right, but some zero is off by more than its rounding, though not by twice that
  double seconds = 0;
  std::string verdict;
};

// SOLVED promises, for each state, y, w and output: an error of at most the tolerance times its own size, or of twice
// its rounding where it is named as zero or to some digits. It is wrong if one breaks this. A refusal is needed if the
// true error of one is above the tolerance times its own size, and, where that is below the tolerance times the size of
// what it stands beside, also above that; or if an ulp of the data moves one as far.
PlainTrial TryPlain(const PlainSystem& plain, const hostile::Reference& reference, const hostile::Asked& asked,
                    double seconds);

}  // namespace dlcs::plain

#endif  // DLCS_TESTS_PLAIN_PLAIN_TRIAL_H_
