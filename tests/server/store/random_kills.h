// SPDX-License-Identifier: Apache-2.0
// How often tests kill, and when: DLCS_KILLS sets how often; DLCS_SEED replays a failure.

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

  // What holds where the environment says nothing. The seed is in the report of the test.
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
