// SPDX-License-Identifier: Apache-2.0
// How many problems a hostile test tries, and from which seed on.

#ifndef DLCS_TESTS_HOSTILE_HOSTILE_COUNT_H_
#define DLCS_TESTS_HOSTILE_HOSTILE_COUNT_H_

namespace dlcs::testing {

struct HostileRange {
  int count;
  unsigned first_seed;
};

// DLCS_HOSTILE_COUNT and DLCS_HOSTILE_SEED of the environment; `few` problems from a fixed seed without them.
HostileRange HostileSeeds(int few);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_HOSTILE_HOSTILE_COUNT_H_
