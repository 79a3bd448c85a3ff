// SPDX-License-Identifier: Apache-2.0
// `dlcs ensemble` as people and scripts use it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/client/cli/program.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using dlcs::testing::QuotedExample;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kRectifierEnsemble =
    "ensemble " + QuotedExample("rectifier") + " " + QuotedExample("rectifier-members") + " ";

TEST(DlcsEnsembleTest, HasALineForEachMemberInTheirOrder) {
  const ProgramOutcome outcome = RunDlcs(kRectifierEnsemble + "--steps 400 --threads 2");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              AllOf(::testing::AnyOf(HasSubstr("rectifier: 6 solved"), HasSubstr("rectifier: 6 reached T")),
                    HasSubstr("half the voltage"), HasSubstr("residual"), HasSubstr("x1"), HasSubstr("shared")));
  EXPECT_LT(outcome.out.find("charged before"), outcome.out.find("with a load"));
}

TEST(DlcsEnsembleTest, GivesProgramsALineForEachMemberOrTime) {
  const ProgramOutcome json = RunDlcs(kRectifierEnsemble + "--steps 400 --at 1 --format json");
  ASSERT_EQ(json.code, 0) << json.err;
  std::istringstream lines(json.out);
  std::map<int, double> x1;
  for (std::string line; std::getline(lines, line);) {
    const auto member = nlohmann::json::parse(line);
    EXPECT_EQ(member["summary"]["termination"], "TERMINATION_REACHED_END");
    EXPECT_EQ(member["trajectory"]["times"], nlohmann::json({1.0}));
    x1[member["member"].get<int>()] = member["trajectory"]["x"][0].get<double>();
  }
  ASSERT_EQ(x1.size(), 6U);
  // Each is the solve of its own problem.
  const ProgramOutcome own =
      RunDlcs("solve " + QuotedExample("rectifier") + " --steps 400 --at 1 --format json --quiet");
  EXPECT_EQ(x1[0], nlohmann::json::parse(own.out)["trajectory"]["x"][0].get<double>());
  // The problem is homogeneous of degree one: half the voltage, half the charge.
  EXPECT_NEAR(x1[1], 0.5 * x1[0], 1e-12);

  const ProgramOutcome csv =
      RunDlcs(kRectifierEnsemble + "--steps 10 --no-estimate-error --at 0,1 --format csv --quiet");
  EXPECT_EQ(csv.code, 0);
  EXPECT_EQ(csv.err, "");
  EXPECT_THAT(csv.out, AllOf(HasSubstr("member,label,t,x1,y1,w1\n"), HasSubstr("\n2,charged before,0,8,")));
}

TEST(DlcsEnsembleTest, SaysWhatIsWrongWithAMember) {
  const std::string problem = "ensemble " + QuotedExample("rectifier") + " - ";
  const ProgramOutcome shape = RunDlcs(problem, "echo '[{\"x0\": [1, 2]}]' | ");
  EXPECT_EQ(shape.code, 2);
  EXPECT_THAT(shape.err, HasSubstr("dlcs: standard input: members[0].x0: 2 components"));
  EXPECT_EQ(shape.out, "");
  const ProgramOutcome key = RunDlcs(problem, "echo '[{\"A\": [[1]]}]' | ");
  EXPECT_EQ(key.code, 2);
  EXPECT_THAT(key.err, HasSubstr("members[0]: \"A\""));
  const ProgramOutcome none = RunDlcs(problem, "echo 'x1' | ");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("at least one"));
}

TEST(DlcsEnsembleTest, SaysWhichMemberHasNoSolutionAndEndsWithOne) {
  const std::string members = ::testing::TempDir() + "dlcs-members.json";
  std::ofstream(members) << R"([{}, {"g": [-1]}])";
  const ProgramOutcome outcome =
      RunDlcs("ensemble - '" + members + "' --steps 10",
              R"(echo '{"A": [[-1]], "B": [[1]], "N": [[0]], "M": [[0]], "x0": [1], "T": 4, "g": [1]}' | )");
  std::filesystem::remove(members);
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr(", 1 failed"), HasSubstr("Member 1: ")));
}

}  // namespace
}  // namespace dlcs::client
