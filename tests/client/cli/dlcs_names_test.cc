// SPDX-License-Identifier: Apache-2.0
// Names of states, pairs and parameters in what `dlcs` prints.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/client/cli/program.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(DlcsNamesTest, StandInTheOutputOfASolve) {
  const std::string solve = "solve " + dlcs::testing::QuotedExample("named-rectifier") + " --quiet ";
  const ProgramOutcome csv = RunDlcs(solve + "--tolerance 1e-8 --at 0.5,1 --format csv");
  EXPECT_EQ(csv.code, 0) << csv.err;
  EXPECT_THAT(csv.out, HasSubstr("t,i,v,diode,w(diode)\n0.5,"));
  const auto root = nlohmann::json::parse(RunDlcs(solve + "--tolerance 1e-8 --at 0.5,1 --format json").out);
  EXPECT_EQ(root["analysis"]["state_names"], nlohmann::json({"i", "v"}));
  EXPECT_EQ(root["analysis"]["pair_names"], nlohmann::json({"diode"}));
  for (std::size_t k = 0; k < 2; ++k) {
    // The diode carries a current or blocks; w is the current.
    EXPECT_EQ(root["trajectory"]["y"][k].get<double>() * root["trajectory"]["w"][k].get<double>(), 0);
    EXPECT_NEAR(root["trajectory"]["w"][k].get<double>(), root["trajectory"]["x"][2 * k].get<double>(), 1e-6);
  }
  EXPECT_THAT(RunDlcs(solve + "--tolerance 1e-8").out, ::testing::ContainsRegex("switch +diode +-"));
}

TEST(DlcsNamesTest, StandInRefusals) {
  auto root = nlohmann::json::parse(R"json({"A": [["-1/R"]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0, 1], "T": 1,
                                        "states": ["vC"], "pairs": ["D1"], "parameters": {"R": 2},
                                        "g": ["1/(t-5)*S"]})json");
  const auto error_of = [&root] { return SolveText(root.dump(), "--quiet").err; };
  EXPECT_THAT(error_of(), AllOf(HasSubstr("x0: 2 components"), HasSubstr("g[0] (D1)"), HasSubstr("S")));
  root["parameters"]["S"] = 1;
  root["x0"] = {0};
  EXPECT_EQ(error_of(), "");
  root["pairs"] = {"vC"};
  EXPECT_THAT(error_of(), HasSubstr("pairs[0]: \"vC\"; is already the name of states[0]"));
  root["pairs"] = {"D1"};
  root["A"] = {{"-1/Q"}};
  EXPECT_THAT(error_of(), AllOf(HasSubstr("A[0][0] (vC, vC)"), HasSubstr("-1/Q")));
}

TEST(DlcsNamesTest, MeanVariablesInNonlinearFormulas) {
  const ProgramOutcome named = SolveText(R"json({"kind": "nonlinear", "T": 1,
      "states": ["pos", "v"], "pairs": ["stop"], "parameters": {"k": 40},
      "f": ["v", "-2*pos - stop"], "g": ["stop - k*(pos - 0.4)"], "x0": [0, 1]})json",
                                         "--quiet --steps 50 --at 1 --format csv");
  const ProgramOutcome plain = SolveText(R"json({"kind": "nonlinear", "T": 1,
      "f": ["x2", "-2*x1 - y1"], "g": ["y1 - 40*(x1 - 0.4)"], "x0": [0, 1]})json",
                                         "--quiet --steps 50 --at 1 --format csv");
  EXPECT_EQ(named.code, 0) << named.err;
  EXPECT_EQ(named.out.substr(0, named.out.find('\n')), "t,pos,v,stop,w(stop)");
  EXPECT_EQ(named.out.substr(named.out.find('\n')), plain.out.substr(plain.out.find('\n')));
}

}  // namespace
}  // namespace dlcs::client
