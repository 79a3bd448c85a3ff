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
  EXPECT_EQ(ReadSpiceNumber("10k\u2126"), 10e3);  // the sign of the ohm
  EXPECT_EQ(ReadSpiceNumber("10k\u03a9"), 10e3);  // the Greek letter
  EXPECT_EQ(ReadSpiceNumber("47\u03bcF"), 47e-6);
}

// A micro sign after a change of the encoding was once read as a unit: 1 farad in place of 1 microfarad.
TEST(SpiceNumberTest, RefusesLettersOfNoUnit) {
  for (const char* text : {"1\u00c2\u00b5", "1\u00ce\u00bc", "10k\u00ce\u00a9", "1\ufffd", "1\u0081", "5k\u00df"}) {
    EXPECT_EQ(ReadSpiceNumber(text), std::nullopt) << text;
    EXPECT_EQ(LeadingSpiceNumber(text).second, 0u) << text;
  }
}

TEST(SpiceNumberTest, RefusesWhatDialectsReadDifferently) {
  for (const char* text : {"4k7", "", "k", "1.2.3", "--1", "1e400", "1 k", "{1}", "0x10"}) {
    EXPECT_EQ(ReadSpiceNumber(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace dlcs::client
