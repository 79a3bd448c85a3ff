// SPDX-License-Identifier: Apache-2.0
#include "client/files/encoding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace dlcs::client {
namespace {

using namespace std::string_literals;
using ::testing::HasSubstr;

// a µ € 𝄞, of one to four bytes in UTF-8; the last is a pair in UTF-16.
constexpr const char* kLetters = "a\u00b5\u20ac\U0001d11e\n";

TEST(EncodingTest, TakesOffAMarkAndConvertsUtf16) {
  EXPECT_EQ(TextOf("MATLAB\0\x01\r"s), "MATLAB\0\x01\r"s);
  EXPECT_EQ(TextOf(kLetters), kLetters);
  EXPECT_EQ(TextOf("\xef\xbb\xbf"s + kLetters), kLetters);
  EXPECT_EQ(TextOf("\xff\xfe"
                   "a\0\xb5\0\xac\x20\x34\xd8\x1e\xdd\n\0"s),
            kLetters);
  EXPECT_EQ(TextOf("\xfe\xff\0a\0\xb5\x20\xac\xd8\x34\xdd\x1e\0\n"s), kLetters);
  EXPECT_EQ(TextOf("\xef\xbb\xbf"), "");
  EXPECT_EQ(TextOf(""), "");
}

TEST(EncodingTest, OnlyTheFirstMarkIsOne) {
  EXPECT_EQ(TextOf("\xef\xbb\xbf\xef\xbb\xbfx"), "\xef\xbb\xbfx");
  EXPECT_EQ(TextOf("x\xef\xbb\xbf"), "x\xef\xbb\xbf");
  EXPECT_EQ(TextOf("\xef\xbb"), "\xef\xbb");
}

TEST(EncodingTest, LeavesBrokenUtf16AsItIs) {
  for (const std::string& broken : {"\xff\xfe"
                                    "a\0b"s,
                                    "\xff\xfe\x1e\xdd"s, "\xff\xfe\x34\xd8"s,
                                    "\xff\xfe\x34\xd8"
                                    "a\0"s,
                                    "\xff\xfe\0\0a\0\0\0"s}) {
    EXPECT_EQ(TextOf(broken), broken);
    EXPECT_THAT(ExplainWideEncoding(broken), HasSubstr("is text in UTF-"));
  }
}

TEST(EncodingTest, KnowsLettersOfUtf8AmongOthers) {
  EXPECT_TRUE(HasUtf8Letters("a \xb5 \u00b5"));
  EXPECT_FALSE(HasUtf8Letters("a \xb5"));
  EXPECT_FALSE(HasUtf8Letters("abc"));
}

TEST(EncodingTest, TakesCarriageReturnsForLineEndsOnlyWhereNothingElseIs) {
  EXPECT_EQ(TextOf("a\rb\r"), "a\nb\n");
  EXPECT_EQ(TextOf("a\r\nb\rc\n"), "a\r\nb\rc\n");
}

}  // namespace
}  // namespace dlcs::client
