// SPDX-License-Identifier: Apache-2.0
#include "server/access/access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/access/token.h"
#include "spdlog/spdlog.h"
#include "tests/server/access/all_methods.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_authority.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(RightsTest, EveryMethodHasARule) {
  const std::vector<std::string> paths = testing::PathsOfAllMethods();
  EXPECT_THAT(paths, ::testing::Contains("/dlcs.v1.JobService/CreateSolveJob"));
  EXPECT_THAT(paths, ::testing::Contains("/dlcs.v1.SolverService/Solve"));
  for (const std::string& path : paths) {
    const auto rule = RuleOf(path);
    ASSERT_TRUE(rule.has_value()) << path << " stands in no line of server/access/permissions.cc";
    // No method of this project is open to everybody.
    EXPECT_EQ(rule->right == Right::kNone, path.starts_with("/grpc.health.")) << path;
    EXPECT_TRUE(!rule->changes || rule->right >= Right::kSubmitter) << path;
  }
}

class AccessTest : public ::testing::Test {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    WriteUsers("reader", "token");
    AccessSettings settings;
    settings.tokens = file_;
    auto access = Access::Open(settings);
    ASSERT_TRUE(access.ok()) << access.status();
    access_ = *std::move(access);
  }
  void WriteUsers(const std::string& right, const std::string& token) {
    testing::ReplaceFile(file_, "alice " + right + " " + TokenHashText(token) + "\nmonitor reader certificate\n");
  }
  absl::Status Call(const std::string& path, std::optional<std::string> authorization,
                    const std::vector<std::string>& names = {}) {
    return access_->MayCall(path, authorization, names);
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string file_ = folder_.File("tokens.txt");
  std::unique_ptr<Access> access_;
};

constexpr const char* kGet = "/dlcs.v1.JobService/GetSolveJob";
constexpr const char* kCreate = "/dlcs.v1.JobService/CreateSolveJob";

TEST_F(AccessTest, SaysWhatIsExpectedAndNeverTheToken) {
  const std::string secret = "dlcs_0123456789";
  EXPECT_THAT(std::string(Call(kGet, std::nullopt).message()), HasSubstr("requires a token"));
  for (const std::string& header : {"Bearer " + secret, "Basic " + secret, secret, "Bearer" + secret,
                                    std::string("Bearer "), std::string(), "Bearer token " + secret}) {
    const absl::Status status = Call(kGet, header);
    EXPECT_EQ(status.code(), absl::StatusCode::kUnauthenticated) << header;
    EXPECT_THAT(std::string(status.message()), AllOf(Not(HasSubstr(secret)), HasSubstr("token"))) << header;
  }
  EXPECT_TRUE(Call(kGet, "Bearer token").ok());
  EXPECT_TRUE(Call(kGet, "bearer token").ok());
}

TEST_F(AccessTest, NamesTheRightThatIsMissing) {
  const absl::Status status = Call(kCreate, "Bearer token");
  EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("\"submitter\""), HasSubstr("alice has the right \"reader\"")));
}

TEST_F(AccessTest, AMethodWithoutARuleIsRefused) {
  EXPECT_EQ(Call("/dlcs.v1.JobService/StealSolveJob", "Bearer token").code(), absl::StatusCode::kUnimplemented);
  EXPECT_EQ(Call("", "Bearer token").code(), absl::StatusCode::kUnimplemented);
  EXPECT_EQ(Call("/dlcs.v1.JobService/StealSolveJob", std::nullopt).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_TRUE(Call("/grpc.health.v1.Health/Check", std::nullopt).ok());
}

TEST_F(AccessTest, ACertificateIsAsGoodAsATokenButATokenComesFirst) {
  EXPECT_TRUE(Call(kGet, std::nullopt, {"monitor"}).ok());
  EXPECT_THAT(std::string(Call(kGet, std::nullopt, {"alice"}).message()),
              HasSubstr("has no user with the name of the client certificate"));
  EXPECT_EQ(Call(kGet, "Bearer wrong", {"monitor"}).code(), absl::StatusCode::kUnauthenticated);
  const std::vector<std::string> monitor = {"monitor"};
  EXPECT_EQ(access_->Identify("Bearer token", monitor)->user, "alice");
}

TEST_F(AccessTest, ReadsTheFileAgainAndKeepsTheOldOneWhereTheNewIsBroken) {
  WriteUsers("submitter", "next");
  access_->Refresh();
  EXPECT_TRUE(Call(kCreate, "Bearer next").ok());
  EXPECT_FALSE(Call(kGet, "Bearer token").ok());
  for (const char* broken : {"", "alice submitter", "alice admin sha256:0\n"}) {
    testing::ReplaceFile(file_, broken);
    access_->Refresh();
    EXPECT_TRUE(Call(kCreate, "Bearer next").ok()) << broken;
  }
  std::filesystem::remove(file_);
  access_->Refresh();
  EXPECT_TRUE(Call(kCreate, "Bearer next").ok());
  WriteUsers("reader", "last");
  access_->Refresh();
  EXPECT_FALSE(Call(kCreate, "Bearer next").ok());
  EXPECT_TRUE(Call(kGet, "Bearer last").ok());
}

TEST(AccessSettingsTest, NamesTheFlagAndTheRule) {
  struct Case {
    AccessSettings settings;
    std::string words;
  };
  std::vector<Case> cases(7);
  cases[0].settings.tls_cert = "c.pem", cases[0].words = "--tls-key: must be given, since --tls-cert c.pem";
  cases[1].settings.tls_key = "c.key", cases[1].words = "--tls-cert: must be given, since --tls-key c.key";
  cases[2].settings.tls_client_ca = "ca", cases[2].words = "--tls-cert: must be given";
  cases[3].settings.max_streams_per_connection = 0, cases[3].words = "--max-streams-per-connection 0: must be";
  cases[4].settings.max_watches_per_user = -1, cases[4].words = "--max-watches-per-user -1: must be";
  cases[5].settings.tls_cert = cases[5].settings.tls_key = "c.pem", cases[5].settings.insecure_listen = true;
  cases[5].words = "--insecure-listen";
  cases[6].settings.tokens = "/nowhere/tokens";
  cases[6].words = "--tokens /nowhere/tokens: cannot be read: No such file";
  for (const Case& wrong : cases) {
    const absl::Status valid = Validate(wrong.settings);
    const absl::Status status = valid.ok() ? Access::Open(wrong.settings).status() : valid;
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(wrong.words));
  }
  EXPECT_TRUE(Validate(AccessSettings()).ok());
}

}  // namespace
}  // namespace dlcs
