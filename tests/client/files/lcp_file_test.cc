// SPDX-License-Identifier: Apache-2.0
#include "client/files/lcp_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(LcpFileTest, ReadsMatrixVectorAndRule) {
  const auto request = ParseLcp(R"({"M": [[2, 1], [0, 1]], "q": [-1, 3], "rule": "least-element"})", "l.json");
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_THAT(request->m().dense().values(), ElementsAre(2, 1, 0, 1));
  EXPECT_THAT(request->q(), ElementsAre(-1, 3));
  EXPECT_EQ(request->rule(), v1::SOLUTION_RULE_LEAST_ELEMENT);
}

TEST(LcpFileTest, RefusesTheKeysOfOtherFiles) {
  const auto request = ParseLcp(R"({"M": [[2]], "x0": [-1]})", "l.json");
  EXPECT_THAT(std::string(request.status().message()),
              AllOf(HasSubstr("l.json: \"x0\" is not a known key"), HasSubstr("\"q\" is missing")));
}

TEST(LcpFileTest, ReadsTheSelectorOfAMinimizer) {
  const auto request =
      ParseLcp(R"({"M": [[0]], "q": [0], "rule": "minimizer", "selector": {"C": [[1]], "b": [2]}})", "l.json");
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->rule(), v1::SOLUTION_RULE_MINIMIZER);
  EXPECT_THAT(request->selector().b(), ElementsAre(2));
}

TEST(DcpFileTest, ReadsMatrixAndPath) {
  const auto request = ParseDcp(R"({"M": [[2]], "q": {"times": [0, 1, 1], "values": [[0], [-1], [2]]}})", "d.json");
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_THAT(request->m().dense().values(), ElementsAre(2));
  EXPECT_THAT(request->q().times(), ElementsAre(0, 1, 1));
  EXPECT_THAT(request->q().values(), ElementsAre(0, -1, 2));
}

TEST(DcpFileTest, NamesWhatIsWrong) {
  EXPECT_THAT(std::string(ParseDcp(R"({"M": [[2]], "q": [1]})", "d.json").status().message()),
              HasSubstr("d.json: q is a list (of 1); must be an object"));
  EXPECT_THAT(
      std::string(ParseDcp(R"({"M": [[2]], "q": {"times": [0, 1], "values": [[1]], "at": 1}, "T": 1})", "d.json")
                      .status()
                      .message()),
      AllOf(HasSubstr("\"T\" is not a known key"), HasSubstr("at"), HasSubstr("q.values has 1 rows")));
}

TEST(DcpFileTest, ReadsAPathAloneOrFromAResult) {
  const std::string path = ::testing::TempDir() + "dlcs-path-test.json";
  for (const char* text : {R"({"times": [0, 1], "values": [[0, 1], [2, 3]]})",
                           R"({"solved": true, "v": {"times": [0, 1], "values": [[0, 1], [2, 3]]}})"}) {
    std::ofstream(path) << text;
    const auto read = ReadPathFile(path);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_THAT(read->values(), ElementsAre(0, 1, 2, 3));
  }
  std::remove(path.c_str());
  EXPECT_FALSE(ReadPathFile(path).ok());
}

}  // namespace
}  // namespace dlcs::client
