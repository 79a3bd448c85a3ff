// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/hostile_count.h"

#include <cstdlib>

namespace dlcs::testing {

HostileRange HostileSeeds(int few) {
  constexpr unsigned kFixedSeed = 90000;
  const char* const count = std::getenv("DLCS_HOSTILE_COUNT");
  const char* const seed = std::getenv("DLCS_HOSTILE_SEED");
  return {count != nullptr ? std::atoi(count) : few,
          seed != nullptr ? static_cast<unsigned>(std::strtoul(seed, nullptr, 10)) : kFixedSeed};
}

}  // namespace dlcs::testing
