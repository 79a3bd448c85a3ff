// SPDX-License-Identifier: Apache-2.0
#include "server/config/config_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace dlcs {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<std::vector<Setting>> Read(const std::string& text) {
  std::istringstream input(text);
  return ReadSettings(input, "dlcsd.conf");
}

TEST(ConfigFileTest, ReadsKeysValuesCommentsAndQuotes) {
  const auto settings = Read(
      "# settings\n"
      "\n"
      "listen = 127.0.0.1:50051 # this machine\r\n"
      "  store=\"/var/lib/a # b.db\"   # jobs\n"
      "name = 'say \"no\"'\n"
      "color = a#b\n"
      "empty = \"\"\n");
  ASSERT_TRUE(settings.ok()) << settings.status();
  const std::vector<Setting> expected = {{"listen", "127.0.0.1:50051", 3},
                                         {"store", "/var/lib/a # b.db", 4},
                                         {"name", "say \"no\"", 5},
                                         {"color", "a#b", 6},
                                         {"empty", "", 7}};
  ASSERT_EQ(settings->size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ((*settings)[i].key, expected[i].key);
    EXPECT_EQ((*settings)[i].value, expected[i].value);
    EXPECT_EQ((*settings)[i].line, expected[i].line);
  }
}

TEST(ConfigFileTest, SkipsAByteOrderMark) {
  const auto settings = Read("\xef\xbb\xbfthreads = 2\r\n");
  ASSERT_TRUE(settings.ok()) << settings.status();
  ASSERT_EQ(settings->size(), 1u);
  EXPECT_EQ(settings->front().key, "threads");
}

TEST(ConfigFileTest, NamesTheLineAndTheRule) {
  struct Case {
    std::string text, words;
  };
  for (const Case& wrong : std::vector<Case>{
           {"threads = 1\nmax-steps\n", "dlcsd.conf:2: max-steps: must be key = value"},
           {"[limits]\n", "dlcsd.conf:1: [limits]: must be key = value"},
           {"= 3\n", "dlcsd.conf:1: = 3: a key is missing before"},
           {"threads =   # none\n", "a value must follow"},
           {"store = \"jobs.db\n", "a quote is not closed"},
           {"store = \"jobs.db\" more\n", "only a comment may follow"},
           {"threads = 1\n\nthreads = 2\n", "dlcsd.conf:3: threads = 2: was already given in line 1"},
       }) {
    const auto settings = Read(wrong.text);
    EXPECT_EQ(settings.status().code(), absl::StatusCode::kInvalidArgument) << wrong.text;
    EXPECT_THAT(std::string(settings.status().message()), HasSubstr(wrong.words));
  }
}

// The regular expressions that look for passwords would overflow the stack.
TEST(ConfigFileTest, RefusesWhatIsTooLongToBeSettings) {
  const std::string url = "store = x://" + std::string(1'000, 'a');
  EXPECT_TRUE(Read(url).ok());
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {"threads = 1\nx://" + std::string(900'000, 'a'),
            "dlcsd.conf:2: has 900004 bytes; a line must have at most 4096"},
           {std::string(2'000'000, '\n'), "dlcsd.conf: has more than 1000000 bytes"}}) {
    const auto settings = Read(text);
    EXPECT_EQ(settings.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(settings.status().message()), HasSubstr(words));
  }
  EXPECT_EQ(WithoutPassword("x://" + std::string(1'000'000, 'a')), "(1000004 bytes)");
}

TEST(ConfigFileTest, ReadsWhatItWrites) {
  for (const std::string value : {"", "12", "-0.5", "true", "a b", "# no comment", "say \"no\"", "it's"}) {
    const auto settings = Read(WriteSetting("key", value));
    ASSERT_TRUE(settings.ok()) << settings.status();
    EXPECT_EQ(settings->at(0).value, value);
  }
}

TEST(ConfigFileTest, ShowsNoPassword) {
  EXPECT_EQ(WithoutPassword("postgresql://me:secret@host/jobs"), "postgresql://me:***@host/jobs");
  EXPECT_EQ(WithoutPassword("--store postgresql://me:se:c/ret@[::1]:5432/jobs: no"),
            "--store postgresql://me:***@[::1]:5432/jobs: no");
  EXPECT_EQ(WithoutPassword("postgresql://host/jobs?user=me&password=secret&sslmode=require"),
            "postgresql://host/jobs?user=me&password=***&sslmode=require");
  EXPECT_EQ(WithoutPassword("host=h password='a b' user=u"), "host=h password=*** user=u");
  EXPECT_EQ(WithoutPassword("postgresql://me@host/jobs"), "postgresql://me@host/jobs");
  EXPECT_EQ(WithoutPassword("http://[::1]:50051"), "http://[::1]:50051");
  // A broken line may hold one too.
  EXPECT_THAT(std::string(Read("store = \"postgresql://me:secret@host\n").status().message()),
              ::testing::Not(HasSubstr("secret")));
}

}  // namespace
}  // namespace dlcs
