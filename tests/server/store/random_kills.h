// SPDX-License-Identifier: Apache-2.0
// The number of kills of a test and their random times: DLCS_KILLS sets the number; DLCS_SEED repeats a failure.

#ifndef DLCS_TESTS_SERVER_STORE_RANDOM_KILLS_H_
#define DLCS_TESTS_SERVER_STORE_RANDOM_KILLS_H_

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>

namespace dlcs::jobs::testing {

struct RandomKills {
  int count;
  unsigned seed;

  // The values without these variables. The report of the test contains the seed.
  explicit RandomKills(unsigned default_count, unsigned default_seed = std::random_device{}())
      : count(static_cast<int>(Asked("DLCS_KILLS", default_count))), seed(Asked("DLCS_SEED", default_seed)) {
    ::testing::Test::RecordProperty("seed", std::to_string(seed));
  }
  std::string trace() const { return "DLCS_SEED=" + std::to_string(seed) + " DLCS_KILLS=" + std::to_string(count); }

 private:
  static unsigned Asked(const char* name, unsigned otherwise) {
    const char* text = std::getenv(name);
    return text != nullptr ? static_cast<unsigned>(std::atoi(text)) : otherwise;
  }
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_RANDOM_KILLS_H_
