// SPDX-License-Identifier: Apache-2.0
// `dlcs` and a server that encrypts and knows its users, as people use them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "server/access/token.h"
#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"
#include "tests/client/cli/program.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_authority.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr const char* kToken = "dlcs_token-of-alice";
const std::string kProblem = dlcs::testing::QuotedExample("rectifier");

class SecureProgramTest : public ::testing::Test {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    const dlcs::testing::Issued issued = authority_.Issue("localhost");
    ServerConfig config;
    config.listen = "127.0.0.1:0";
    config.store = folder_.File("jobs.db");
    config.access.tls_cert = File("server.pem", issued.certificate);
    config.access.tls_key = File("server.key", issued.key);
    config.access.tokens = File("tokens.txt", std::string("alice submitter ") + TokenHashText(kToken) + "\n");
    auto server = DlcsServer::Start(config);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  std::string File(const std::string& name, const std::string& content) {
    dlcs::testing::ReplaceFile(folder_.File(name), content);
    return folder_.File(name);
  }
  std::string Server() const { return " --server " + server_->address(); }
  std::string Ca() { return " --tls-ca " + File("ca.pem", authority_.certificate()); }
  std::string Token() { return " --token-file " + File("alice.token", std::string(kToken) + "\n"); }

  jobs::testing::TemporaryFolder folder_;
  const dlcs::testing::TestAuthority authority_;
  std::unique_ptr<DlcsServer> server_;
};

TEST_F(SecureProgramTest, EveryCommandTakesTheOptions) {
  const std::string where = Server() + Ca() + Token();
  EXPECT_EQ(RunDlcs("capabilities" + where).code, 0);
  EXPECT_EQ(RunDlcs("analyze " + kProblem + where).code, 0);
  const ProgramOutcome solved = RunDlcs("solve " + kProblem + " --quiet --format csv" + where);
  EXPECT_EQ(solved.code, 0) << solved.err;
  EXPECT_EQ(solved.out, RunDlcs("solve " + kProblem + " --quiet --format csv").out);
  EXPECT_EQ(RunDlcs("lcp -" + where, R"(echo '{"M": [[2]], "q": [-1]}' | )").code, 0);
  const ProgramOutcome job = RunDlcs("submit " + kProblem + where);
  ASSERT_THAT(job.out, MatchesRegex("jobs/[a-z2-7]+\n")) << job.err;
  const std::string name = job.out.substr(0, job.out.size() - 1);
  for (const std::string command : {"watch ", "get ", "result ", "cancel ", "delete "}) {
    const ProgramOutcome outcome = RunDlcs(command + name + where);
    EXPECT_EQ(outcome.code, 0) << command << outcome.err;
  }
  EXPECT_EQ(RunDlcs("list" + where).code, 0);
  EXPECT_EQ(RunDlcs("health" + where).code, 0);
}

// Health checks have no token.
TEST_F(SecureProgramTest, HealthNeedsEncryptionAndNoToken) {
  for (const std::string service : {"", " --service dlcs.v1.JobService"}) {
    const ProgramOutcome serving = RunDlcs("health" + Server() + Ca() + service);
    EXPECT_EQ(serving.code, 0) << serving.err;
    EXPECT_EQ(serving.out, "SERVING\n");
  }
  const ProgramOutcome plain = RunDlcs("health" + Server());
  EXPECT_EQ(plain.code, 3);
  EXPECT_EQ(plain.out, "");
  EXPECT_THAT(plain.err, HasSubstr("wants encrypted connections"));
  const dlcs::testing::TestAuthority other;
  EXPECT_EQ(RunDlcs("health" + Server() + " --tls-ca " + File("other.pem", other.certificate())).code, 3);
}

TEST_F(SecureProgramTest, SaysWhatIsMissingAndNothingElse) {
  const ProgramOutcome plain = RunDlcs("capabilities" + Server());
  EXPECT_EQ(plain.code, 3);
  EXPECT_THAT(plain.err, AllOf(HasSubstr("wants encrypted connections"), HasSubstr("--tls-ca")));
  const ProgramOutcome nameless = RunDlcs("list" + Server() + Ca());
  EXPECT_EQ(nameless.code, 3);
  EXPECT_THAT(nameless.err, AllOf(HasSubstr("requires a token"), HasSubstr("--token-file")));
  const dlcs::testing::TestAuthority other;
  const ProgramOutcome foreign = RunDlcs("list" + Server() + " --tls-ca " + File("other.pem", other.certificate()));
  EXPECT_EQ(foreign.code, 3);
  EXPECT_THAT(foreign.err, AllOf(HasSubstr("not from an authority in"), Not(HasSubstr("SSL_ERROR"))));
  for (const ProgramOutcome& outcome : {plain, nameless, foreign}) {
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

TEST_F(SecureProgramTest, TakesATokenFromTheEnvironmentAndKeepsItSecret) {
  const std::string environment = std::string("DLCS_TOKEN=") + kToken + " ";
  EXPECT_EQ(RunDlcs("capabilities" + Server() + Ca(), environment).code, 0);
  const ProgramOutcome elsewhere = RunDlcs("list --server example.com:1", environment);
  EXPECT_EQ(elsewhere.code, 2);
  EXPECT_THAT(elsewhere.err, AllOf(HasSubstr("DLCS_TOKEN: is not sent to example.com:1"), Not(HasSubstr(kToken))));
  const ProgramOutcome typed = RunDlcs("list --server example.com:1" + Token());
  EXPECT_EQ(typed.code, 2);
  EXPECT_THAT(typed.err, AllOf(HasSubstr("--token-file: "), HasSubstr(": is not sent to example.com:1")));
}

TEST_F(SecureProgramTest, NamesTheOptionTheFileAndTheRule) {
  struct Case {
    std::string options, words;
  };
  for (const Case& wrong : {Case{" --token-file /nowhere", "--token-file: /nowhere: cannot be read: No such file"},
                            Case{" --token-file /dev/null", "--token-file: /dev/null: is empty"},
                            Case{" --tls-ca /nowhere", "--tls-ca: /nowhere: cannot be read: No such file"},
                            Case{" --tls-ca " + folder_.File("server.key"),
                                 "--tls-ca: " + folder_.File("server.key") + ": holds no certificate"},
                            Case{" --tls-cert " + folder_.File("server.pem"), "--tls-key: must be given"}}) {
    const ProgramOutcome outcome = RunDlcs("capabilities" + Server() + wrong.options);
    EXPECT_EQ(outcome.code, 2) << wrong.options;
    EXPECT_THAT(outcome.err, HasSubstr(wrong.words));
  }
  const ProgramOutcome here = RunDlcs("solve " + kProblem + Ca());
  EXPECT_EQ(here.code, 2);
  EXPECT_THAT(here.err, HasSubstr("--server"));
}

TEST_F(SecureProgramTest, HealthOfAServerThatWantsCertificatesNeedsOne) {
  const dlcs::testing::Issued issued = authority_.Issue("localhost");
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  config.access.tls_cert = File("other-server.pem", issued.certificate);
  config.access.tls_key = File("other-server.key", issued.key);
  config.access.tls_client_ca = File("clients.pem", authority_.certificate());
  const auto server = DlcsServer::Start(config);
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string health = "health --server " + (*server)->address() + Ca();
  const ProgramOutcome without = RunDlcs(health);
  EXPECT_EQ(without.code, 3);
  EXPECT_THAT(without.err, HasSubstr("--tls-cert"));
  const dlcs::testing::Issued probe = authority_.Issue("probe");
  const ProgramOutcome with = RunDlcs(health + " --tls-cert " + File("probe.pem", probe.certificate) + " --tls-key " +
                                      File("probe.key", probe.key));
  EXPECT_EQ(with.code, 0) << with.err;
}

}  // namespace
}  // namespace dlcs::client
