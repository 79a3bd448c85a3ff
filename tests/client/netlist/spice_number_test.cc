// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/spice_number.h"

#include <gtest/gtest.h>

#include <optional>

namespace dlcs::client {
namespace {

TEST(SpiceNumberTest, ReadsSuffixesAndIgnoresUnits) {
  EXPECT_EQ(ReadSpiceNumber("10k"), 10e3);
  EXPECT_EQ(ReadSpiceNumber("47uF"), 47e-6);
  EXPECT_EQ(ReadSpiceNumber("47\xc2\xb5"), 47e-6);
  EXPECT_EQ(ReadSpiceNumber("1Meg"), 1e6);
  EXPECT_EQ(ReadSpiceNumber("1MegOhm"), 1e6);
  EXPECT_EQ(ReadSpiceNumber("1M"), 1e-3);
  EXPECT_EQ(ReadSpiceNumber("1MIL"), 25.4e-6);
  EXPECT_EQ(ReadSpiceNumber("1F"), 1e-15);
  EXPECT_EQ(ReadSpiceNumber("5V"), 5);
  EXPECT_EQ(ReadSpiceNumber("5A"), 5);
  EXPECT_EQ(ReadSpiceNumber("-.5e-3k"), -0.5);
  EXPECT_EQ(ReadSpiceNumber("2.2T"), 2.2e12);
}

TEST(SpiceNumberTest, RefusesWhatDialectsReadDifferently) {
  for (const char* text : {"4k7", "", "k", "1.2.3", "--1", "1e400", "1 k", "{1}", "0x10"}) {
    EXPECT_EQ(ReadSpiceNumber(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace dlcs::client
