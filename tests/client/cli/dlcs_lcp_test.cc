// SPDX-License-Identifier: Apache-2.0
// `dlcs lcp` and `dlcs dcp`: problems without a differential equation.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/client/cli/program.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using dlcs::testing::QuotedExample;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DlcsLcpTest, SolvesAnLcp) {
  const ProgramOutcome outcome = RunDlcs("lcp - --format json", R"(echo '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}' | )");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto root = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(root["verdict"], "LCP_STATUS_SOLVED");
  EXPECT_NEAR(root["y"][0].get<double>(), 4.0 / 3, 1e-14);
  EXPECT_LT(root["residual"].get<double>(), 1e-14);
  const ProgramOutcome none = RunDlcs("lcp -", R"(echo '{"M": [[0]], "q": [-1]}' | )");
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.out, HasSubstr("INFEASIBLE"));
}

TEST(DlcsLcpTest, ListsAllSolutionsOfAnLcp) {
  const std::string lcp = R"(echo '{"M": [[1, 1], [1, 1]], "q": [-1, -1], "rule": "least-norm"}' | )";
  const ProgramOutcome table = RunDlcs("lcp - --all", lcp);
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("J (y > 0)      {0, 1}"), HasSubstr("2 basic solutions"),
                               HasSubstr("a continuum with w = 0 on {0, 1}")));
  const auto root = nlohmann::json::parse(RunDlcs("lcp - --format json", lcp).out);
  EXPECT_NEAR(root["y"][0].get<double>(), 0.5, 1e-12);
  EXPECT_FALSE(root.contains("all"));
}

TEST(DlcsLcpTest, RefusesASelectorWithoutItsRule) {
  const ProgramOutcome outcome =
      RunDlcs("lcp -", R"(echo '{"M": [[1]], "q": [-1], "selector": {"C": [[1]], "b": [0]}}' | )");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("standard input: selector: "));
}

TEST(DlcsLcpTest, ShowsTwoSolutionsOfExampleTen) {
  const std::string example = "dcp " + QuotedExample("example-10-dcp");
  const ProgramOutcome solved = RunDlcs(example + " --step 0.01");
  EXPECT_EQ(solved.code, 0) << solved.err;
  EXPECT_THAT(solved.out, AllOf(HasSubstr("SOLVED"), HasSubstr("  1   0.25   0.25   0.25\n"), HasSubstr("unknown")));
  const auto other =
      nlohmann::json::parse(RunDlcs(example + " --format json --check " + QuotedExample("example-10-dcp-other")).out);
  EXPECT_EQ(other["certificate"]["start"], 0);
  EXPECT_GE(other["certificate"]["least_increase"].get<double>(), 0);
  EXPECT_GE(other["certificate"]["least_w"].get<double>(), -1e-15);
  EXPECT_LE(other["certificate"]["complementarity"].get<double>(), 1e-15);
}

TEST(DlcsLcpTest, AScriptSeesWhetherAPathSolvesADcp) {
  const std::string example = "dcp " + QuotedExample("example-10-dcp") + " --check ";
  const ProgramOutcome sound = RunDlcs(example + QuotedExample("example-10-dcp-other"));
  EXPECT_EQ(sound.code, 0) << sound.err;
  EXPECT_THAT(sound.out, AllOf(HasSubstr("SOLVED: the path is a solution"), HasSubstr("Certificate")));
  const std::string zero = R"(echo '{"times": [0, 1], "values": [[0, 0, 0], [0, 0, 0]]}' | )";
  const ProgramOutcome wrong = RunDlcs(example + "-", zero);
  EXPECT_EQ(wrong.code, 1) << wrong.err;
  EXPECT_THAT(wrong.out, AllOf(HasSubstr("NOT SOLVED: the path is not a solution: w goes below 0 by 1, 1 of its size"),
                               HasSubstr("Certificate")));
  EXPECT_EQ(RunDlcs(example + "- --format json", zero).code, 1);
}

TEST(DlcsLcpTest, NamesWhatIsWrongWithADcp) {
  const ProgramOutcome start = RunDlcs("dcp -", R"(echo '{"M": [[1]], "q": {"times": [0], "values": [[-1]]}}' | )");
  EXPECT_EQ(start.code, 2);
  EXPECT_THAT(start.err, HasSubstr("standard input: q.values[0][0]: -1; q(0) must be >= 0"));
  const std::string sound = R"(echo '{"M": [[0]], "q": {"times": [0, 1], "values": [[0], [-1]]}}' | )";
  const ProgramOutcome none = RunDlcs("dcp -", sound);
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.out, AllOf(HasSubstr("NOT SOLVED"), HasSubstr("INFEASIBLE"), Not(HasSubstr("Certificate"))));
  EXPECT_EQ(RunDlcs("dcp - --step 0", sound).code, 2);
  EXPECT_EQ(RunDlcs("dcp - --check no/such/path.json", sound).code, 2);
  EXPECT_EQ(RunDlcs("dcp - --step 1 --check v.json", sound).code, 2);
}

}  // namespace
}  // namespace dlcs::client
