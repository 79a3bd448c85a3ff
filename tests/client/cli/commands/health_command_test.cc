// SPDX-License-Identifier: Apache-2.0
// `dlcs health` as people, containers and scripts use it; with TLS and tokens in secure_program_test.cc.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"
#include "tests/client/cli/program.h"
#include "tests/server/store/postgres/postgres_server.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kSolver = "dlcs.v1.SolverService";
constexpr const char* kJobs = "dlcs.v1.JobService";

std::unique_ptr<DlcsServer> Start(const std::string& role, const std::string& store) {
  spdlog::set_level(spdlog::level::off);  // passing tests print nothing
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  config.role = role;
  config.store = store;
  auto server = DlcsServer::Start(config);
  EXPECT_TRUE(server.ok()) << server.status();
  return *std::move(server);
}

ProgramOutcome HealthOf(const DlcsServer& server, const std::string& service) {
  return RunDlcs("health --server " + server.address() + (service.empty() ? "" : " --service " + service));
}

// The first outcome that prints `state`, or the last within a minute: health follows the store, but not at once.
ProgramOutcome AwaitHealth(const DlcsServer& server, const std::string& service, const std::string& state) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  ProgramOutcome outcome = HealthOf(server, service);
  while (outcome.out != state + "\n" && std::chrono::steady_clock::now() < give_up) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    outcome = HealthOf(server, service);
  }
  return outcome;
}

TEST(HealthCommandTest, TellsOfAServerThatServesUntilItDrains) {
  const auto server = Start("all", "");
  for (const std::string service : {"", kSolver}) {
    const ProgramOutcome serving = HealthOf(*server, service);
    EXPECT_EQ(serving.code, 0) << serving.err;
    EXPECT_EQ(serving.out, "SERVING\n");
    EXPECT_EQ(serving.err, "");
  }
  server->Drain();
  for (const std::string service : {"", kSolver}) {
    const ProgramOutcome draining = HealthOf(*server, service);
    EXPECT_EQ(draining.code, 1);
    EXPECT_EQ(draining.out, "NOT_SERVING\n");
    EXPECT_THAT(draining.err, AllOf(HasSubstr(server->address()), HasSubstr("shutting down")));
  }
}

TEST(HealthCommandTest, OfJobsFollowsTheStore) {
  const jobs::testing::TemporaryFolder folder;
  const auto server = Start("all", folder.File("jobs.db"));
  EXPECT_EQ(AwaitHealth(*server, kJobs, "SERVING").code, 0);
  std::filesystem::rename(folder.File("jobs.db"), folder.File("elsewhere.db"));
  const ProgramOutcome away = AwaitHealth(*server, kJobs, "NOT_SERVING");
  EXPECT_EQ(away.code, 1);
  EXPECT_THAT(away.err, AllOf(HasSubstr(kJobs), HasSubstr("its store does not answer")));
  EXPECT_EQ(HealthOf(*server, "").code, 0);
  std::filesystem::rename(folder.File("elsewhere.db"), folder.File("jobs.db"));
  EXPECT_EQ(AwaitHealth(*server, kJobs, "SERVING").code, 0);
}

TEST(HealthCommandTest, AsksFrontsAndWorkersAlike) {
  const jobs::testing::PostgresServer database;
  const auto front = Start("front", database.address());
  const auto worker = Start("worker", database.address());
  for (const std::string service : {"", kJobs}) {
    EXPECT_EQ(AwaitHealth(*front, service, "SERVING").code, 0) << service;
    EXPECT_EQ(AwaitHealth(*worker, service, "SERVING").code, 0) << service;
  }
  EXPECT_EQ(HealthOf(*front, kSolver).code, 0);
  const ProgramOutcome calls_of_worker = HealthOf(*worker, kSolver);
  EXPECT_EQ(calls_of_worker.code, 1);
  EXPECT_EQ(calls_of_worker.out, "SERVICE_UNKNOWN\n");
  EXPECT_THAT(calls_of_worker.err, AllOf(HasSubstr(kSolver), HasSubstr("but a worker")));
}

TEST(HealthCommandTest, NamesAServiceThatTheServerDoesNotHave) {
  const auto server = Start("all", "");
  const ProgramOutcome unknown = HealthOf(*server, kJobs);  // without a store
  EXPECT_EQ(unknown.code, 1);
  EXPECT_EQ(unknown.out, "SERVICE_UNKNOWN\n");
  EXPECT_THAT(unknown.err, AllOf(HasSubstr(kJobs), HasSubstr("--store")));
}

TEST(HealthCommandTest, ExitsWithThreeWhereNobodyAnswers) {
  const ProgramOutcome nobody = RunDlcs("health --server 127.0.0.1:1");
  EXPECT_EQ(nobody.code, 3);
  EXPECT_EQ(nobody.out, "");
  EXPECT_THAT(nobody.err, HasSubstr("no server answers at 127.0.0.1:1 (Connection refused). Check"));

  // A server that accepts connections, and does nothing else.
  const int mute = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  ASSERT_EQ(bind(mute, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(mute, 8), 0);
  ASSERT_EQ(getsockname(mute, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const ProgramOutcome silent =
      RunDlcs("health --deadline 0.5 --server 127.0.0.1:" + std::to_string(ntohs(address.sin_port)));
  close(mute);
  EXPECT_EQ(silent.code, 3);
  EXPECT_EQ(silent.out, "");
  EXPECT_THAT(silent.err, HasSubstr("the deadline passed before 127.0.0.1"));
}

TEST(HealthCommandTest, ExitsWithTwoOnBadOptions) {
  EXPECT_EQ(RunDlcs("health --server localhost").code, 2);
  EXPECT_EQ(RunDlcs("health --deadline 0").code, 2);
  EXPECT_EQ(RunDlcs("health --tls-ca /nowhere").code, 2);
  EXPECT_EQ(RunDlcs("health dlcs.v1.JobService").code, 2);
  const ProgramOutcome help = RunDlcs("health --help");
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("--service"), HasSubstr("Exit codes: 0 SERVING")));
}

}  // namespace
}  // namespace dlcs::client
