// SPDX-License-Identifier: Apache-2.0
#include "server/access/users.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "server/access/token.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string Line(const std::string& name, const std::string& right, const std::string& token) {
  return name + " " + right + " " + TokenHashText(token) + "\n";
}

TEST(UsersTest, FindsWhoHasATokenOrACertificate) {
  const auto users =
      Users::Parse("# people\n\n" + Line("alice", "submitter", "first") + Line("bob", "admin", "other") +
                       "  monitor\treader certificate  # on the wall\r\n" + Line("alice", "submitter", "second"),
                   "users");
  ASSERT_TRUE(users.ok()) << users.status();
  EXPECT_EQ(users->size(), 4u);
  ASSERT_NE(users->WithToken("first"), nullptr);
  EXPECT_EQ(users->WithToken("first")->name, "alice");
  EXPECT_EQ(users->WithToken("second")->right, Right::kSubmitter);
  EXPECT_EQ(users->WithToken("other")->right, Right::kAdmin);
  EXPECT_EQ(users->WithToken("third"), nullptr);
  EXPECT_EQ(users->WithToken(""), nullptr);
  // The file holds no token that could be stolen from it.
  EXPECT_EQ(users->WithToken(TokenHashText("first")), nullptr);
  EXPECT_EQ(users->WithToken(TokenHash("first")), nullptr);

  const std::vector<std::string> names = {"somebody", "monitor"};
  ASSERT_NE(users->WithCertificate(names), nullptr);
  EXPECT_EQ(users->WithCertificate(names)->right, Right::kReader);
  const std::vector<std::string> token_user = {"alice"};
  EXPECT_EQ(users->WithCertificate(token_user), nullptr);
  EXPECT_EQ(users->WithCertificate({}), nullptr);
}

TEST(UsersTest, RefusesALineWithItsNumberAndTheRuleButNotItsWords) {
  const std::string good = Line("alice", "submitter", "first");
  struct Case {
    std::string line, words;
  };
  const std::string secret = "dlcs_secret";
  for (const Case& wrong : {Case{"alice reader\n", "has 2 words; must be NAME RIGHT sha256:HASH"},
                            Case{"alice reader " + secret + " x\n", "has 4 words"},
                            Case{"alice boss " + TokenHashText("x"), "reader, submitter or admin"},
                            Case{"bob reader " + secret, "64 hexadecimal digits"},
                            Case{"bob reader sha256:" + secret, "64 hexadecimal digits"},
                            Case{"b\xc3\xb6"
                                 "b reader certificate",
                                 "the name must be"},
                            Case{std::string(129, 'b') + " reader certificate", "the name must be"},
                            Case{Line("alice", "admin", "x"), "submitter on an earlier line, and admin here"},
                            Case{Line("bob", "reader", "first"), "of alice"}}) {
    const auto users = Users::Parse(good + wrong.line, "users.txt");
    ASSERT_FALSE(users.ok()) << wrong.line;
    EXPECT_THAT(std::string(users.status().message()),
                AllOf(HasSubstr("users.txt:2: "), HasSubstr(wrong.words), Not(HasSubstr(secret))));
  }
  EXPECT_THAT(std::string(Users::Parse("# nobody\n", "users.txt").status().message()), HasSubstr("at least one user"));
  EXPECT_THAT(std::string(Users::Read("/nowhere/users.txt").status().message()),
              AllOf(HasSubstr("/nowhere/users.txt"), HasSubstr("No such file")));
  EXPECT_THAT(std::string(Users::Read("/dev/zero").status().message()), HasSubstr("more than 1000000 bytes"));
}

TEST(UsersTest, ReadsAFileWithAByteOrderMark) {
  const std::string path = ::testing::TempDir() + "users-with-mark.txt";
  std::ofstream(path) << "\xef\xbb\xbf" << Line("alice", "submitter", "first");
  const absl::StatusOr<Users> users = Users::Read(path);
  ASSERT_TRUE(users.ok()) << users.status();
  EXPECT_NE(users->WithToken("first"), nullptr);
}

TEST(TokenTest, TokensAreOfTheirKindAndDiffer) {
  const std::string token = RandomToken();
  EXPECT_THAT(token, ::testing::MatchesRegex("dlcs_[A-Za-z0-9_-]+"));
  EXPECT_EQ(token.size(), 5u + 43u);
  EXPECT_NE(RandomToken(), token);
  // From sha256sum.
  EXPECT_EQ(TokenHashText("abc"), "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace dlcs
