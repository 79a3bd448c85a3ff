// SPDX-License-Identifier: Apache-2.0
// Where `dlcs` solves: here, or on a server that was named in one of several ways.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"
#include "tests/client/cli/program.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using dlcs::testing::QuotedCase;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DlcsServerChoiceTest, ExitsWithThreeWhenNobodyServes) {
  const ProgramOutcome outcome = RunDlcs("solve " + QuotedCase("rlcd") + " --server 127.0.0.1:1");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("dlcsd --listen 127.0.0.1:1"));
  EXPECT_EQ(outcome.out, "");
}

TEST(DlcsServerChoiceTest, SolvesNowhereElseThanWasMeant) {
  const ProgramOutcome empty = RunDlcs("solve " + QuotedCase("rlcd") + " --server \"$NOT_SET\"");
  EXPECT_EQ(empty.code, 2);
  EXPECT_THAT(empty.err, AllOf(HasSubstr("--server"), HasSubstr("is empty")));
  const ProgramOutcome variable = RunDlcs("solve " + QuotedCase("rlcd"), "DLCS_SERVER= ");
  EXPECT_EQ(variable.code, 2);
  EXPECT_THAT(variable.err, HasSubstr("DLCS_SERVER is set but empty"));
}

TEST(DlcsServerChoiceTest, TakesTheServerFromTheEnvironmentOrAContext) {
  spdlog::set_level(spdlog::level::off);
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  const auto server = DlcsServer::Start(config);
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string address = (*server)->address();
  const std::string solve = "solve " + QuotedCase("rlcd") + " --steps 50 ";
  const ProgramOutcome variable = RunDlcs(solve, "DLCS_SERVER=" + address + " ");
  EXPECT_THAT(variable.err, HasSubstr("dlcs: on " + address + " (DLCS_SERVER)"));
  EXPECT_THAT(RunDlcs(solve + "--local", "DLCS_SERVER=" + address + " ").err, Not(HasSubstr("dlcs: on ")));

  const std::string folder = ::testing::TempDir() + "dlcs-program-test-config";
  std::filesystem::remove_all(folder);
  const std::string config_home = "XDG_CONFIG_HOME=" + folder + " ";
  EXPECT_EQ(RunDlcs("context set lab --server " + address, config_home).code, 0);
  EXPECT_EQ(RunDlcs("context set far --server far.example:1 --tls", config_home).code, 0);
  EXPECT_THAT(RunDlcs(solve, "DLCS_SERVER=here ").err, HasSubstr("DLCS_SERVER: \"here\" is not HOST:PORT"));
  const ProgramOutcome wrong = RunDlcs("context set wrong --server far.example", config_home);
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--server: \"far.example\" is not HOST:PORT"));
  EXPECT_EQ(RunDlcs("context use lab", config_home).code, 0);
  EXPECT_THAT(RunDlcs("context list", config_home).out,
              AllOf(HasSubstr("* lab"), HasSubstr("  far"), HasSubstr("encrypted")));
  EXPECT_THAT(RunDlcs(solve, config_home).err, HasSubstr("dlcs: on " + address + " (context lab)"));
  EXPECT_EQ(RunDlcs("health", config_home).out, "SERVING\n");
  EXPECT_EQ(RunDlcs(solve + "--context lab", config_home).code, 0);
  const ProgramOutcome unknown = RunDlcs(solve, config_home + "DLCS_CONTEXT=lob ");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean lab?"));
  EXPECT_EQ(RunDlcs("context delete lab", config_home).code, 0);
  EXPECT_THAT(RunDlcs(solve, config_home).err, Not(HasSubstr("dlcs: on ")));
  std::filesystem::remove_all(folder);
}

TEST(DlcsServerChoiceTest, GivesTheSameAnswerFromAServer) {
  spdlog::set_level(spdlog::level::off);  // passing tests print nothing
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  const auto server = DlcsServer::Start(config);
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string where = " --server " + (*server)->address();
  const std::string solve = "solve " + QuotedCase("leontief_stock") + " --format csv --quiet";
  const ProgramOutcome here = RunDlcs(solve);
  const ProgramOutcome there = RunDlcs(solve + where);
  EXPECT_EQ(here.code, 0) << here.err;
  EXPECT_EQ(there.code, 0) << there.err;
  EXPECT_EQ(here.out, there.out);

  const ProgramOutcome capabilities = RunDlcs("capabilities --format json" + where);
  EXPECT_EQ(capabilities.code, 0) << capabilities.err;
  EXPECT_GT(nlohmann::json::parse(capabilities.out)["max_states"].get<int>(), 0);
  const ProgramOutcome refused =
      SolveText(R"({"A": [[-1]], "B": [[1, 2]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4})", where);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("standard input: B: "));
}

}  // namespace
}  // namespace dlcs::client
