// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/spice_number.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

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

// What is written in a deck and what is written in an option must be one number to the last bit, and so must 1.1m and
// 1.1e-3: a time may be the end of the solve.
TEST(SpiceNumberTest, ReadsTheNearestDouble) {
  for (int k = 1; k < 2000; ++k) {
    const std::string digits = std::to_string(k / 100) + "." + std::to_string(k % 100);
    for (const auto& [suffix, exponent] :
         {std::pair("m", "e-3"), {"u", "e-6"}, {"n", "e-9"}, {"k", "e3"}, {"t", "e12"}}) {
      const double nearest = std::strtod((digits + exponent).c_str(), nullptr);
      EXPECT_EQ(ReadSpiceNumber(digits + suffix), nearest) << digits << suffix;
      EXPECT_EQ(ReadNumberWithSuffix(digits + suffix), nearest) << digits << suffix;
    }
  }
  EXPECT_EQ(ReadSpiceNumber("1e-3k"), 1);
  EXPECT_EQ(ReadSpiceNumber("1.5e+2m"), 0.15);
  EXPECT_EQ(ReadSpiceNumber("5e300g"), std::nullopt);
  EXPECT_EQ(ReadSpiceNumber("1e99999999999k"), std::nullopt);
  EXPECT_EQ(ReadSpiceNumber("2mil"), 50.8e-6);
}

TEST(SpiceNumberTest, OptionsHaveNoUnits) {
  EXPECT_EQ(ReadNumberWithSuffix("1Meg"), 1e6);
  EXPECT_EQ(ReadNumberWithSuffix("-2.5K"), -2500);
  EXPECT_EQ(ReadNumberWithSuffix("7"), 7);
  for (const char* text : {"1M", "1ms", "1x", "1mil", "", "m", "-", "4k7", "1 m", "1mm"}) {
    EXPECT_EQ(ReadNumberWithSuffix(text), std::nullopt) << text;
  }
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
