// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and SIGTERM with the built program: real processes, real signals.
#include "client/cli/commands/interrupt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/rpc/client.h"
#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"
#include "tests/client/cli/running_program.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

class InterruptTest : public ::testing::Test {
 protected:
  InterruptTest() { std::ofstream(problem_) << kEasyProblem; }

  // A solve that takes minutes, and reports when it begins.
  std::vector<std::string> LongSolve(const std::vector<std::string>& options = {}) const {
    std::vector<std::string> arguments = {"solve", problem_, "--method", "wu-chen-iteration", "--steps", "200000"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return arguments;
  }

  void StartServer(const std::string& store) {
    spdlog::set_level(spdlog::level::off);
    ServerConfig config;
    config.listen = "127.0.0.1:0";
    config.store = store;
    config.checkpoint_ms = 20;
    auto server = DlcsServer::Start(config);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  void StartServerWithJobs() {
    StartServer(folder_.File("jobs.db"));
    auto client = Client::Connect(server_->address());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  v1::SolveJob TheJob() {
    const auto jobs = client_->jobs().List({}, 10, {});
    EXPECT_TRUE(jobs.ok()) << jobs.status();
    return jobs.ok() && jobs->size() == 1 ? jobs->front() : v1::SolveJob();
  }

  // The only job, when it has reached this state.
  v1::SolveJob AwaitProgress(double progress) {
    v1::SolveJob job = TheJob();
    while (job.progress() < progress) job = TheJob();
    return job;
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string problem_ = folder_.File("easy.json");
  std::unique_ptr<DlcsServer> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(InterruptTest, PrintsWhatIsKnownAndExitsAsShellsExpect) {
  for (const int signal : {SIGINT, SIGTERM}) {
    RunningProgram program(LongSolve({"--format", "json"}));
    program.AwaitErrorText("200000 steps");
    EXPECT_TRUE(program.HasLoaded("openblas"));
    program.Send({signal});
    const ProgramOutcome outcome = program.Await();
    EXPECT_EQ(outcome.code, 128 + signal) << outcome.err;
    const auto root = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(root["summary"]["termination"], "TERMINATION_CANCELLED");
    EXPECT_EQ(root["summary"]["method"], "METHOD_WU_CHEN_ITERATION");
  }
}

TEST_F(InterruptTest, TheSecondSignalEndsItAtOnce) {
  RunningProgram program(LongSolve());
  program.AwaitErrorText("200000 steps");
  program.Send({SIGINT, SIGTERM});
  const ProgramOutcome outcome = program.Await();
  EXPECT_THAT(outcome.code, AnyOf(130, 143));
  EXPECT_EQ(outcome.out, "");
}

TEST_F(InterruptTest, WhatWasIgnoredStaysIgnored) {
  RunningProgram program(LongSolve(), {.ignores_interrupts = true});
  program.AwaitErrorText("200000 steps");
  program.Send({SIGINT, SIGTERM});  // which would be two
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 143);
  EXPECT_THAT(outcome.out, HasSubstr("CANCELLED"));
}

TEST_F(InterruptTest, APartOfAResultDoesNotGetTheNameOfTheWhole) {
  const std::string path = folder_.File("easy.csv");
  std::ofstream(path) << "before";
  RunningProgram program({"solve", problem_, "--method", "exponential-integrator", "--steps", "20000000", "--format",
                          "csv", "--no-estimate-error", "--output", path});
  program.AwaitErrorText("20000000 steps");
  program.Send({SIGTERM});
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 143);
  EXPECT_THAT(outcome.err, HasSubstr("wrote the incomplete trajectory to " + path + ".partial"));
  EXPECT_TRUE(std::filesystem::exists(path + ".partial"));
  std::ifstream stream(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), "before");
}

TEST_F(InterruptTest, AServedSolveIsShownAsOneHereAndItsJobNamed) {
  StartServerWithJobs();
  RunningProgram program({"solve", problem_, "--server", server_->address(), "--method", "time-stepping", "--steps",
                          "15000000", "--no-estimate-error", "--at", "0.04,4", "--format", "json"});
  const v1::SolveJob job = [&] {
    program.AwaitErrorText("15000000 steps");
    return AwaitProgress(0.02);
  }();
  program.Send({SIGINT});
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 130) << outcome.err;
  const auto root = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(root["summary"]["termination"], "TERMINATION_CANCELLED");
  EXPECT_EQ(root["trajectory"]["times"], nlohmann::json({0.04}));
  EXPECT_LT(root["summary"]["certificate"]["node_residual"].get<double>(), 1e-10);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("dlcs result " + job.name()), Not(HasSubstr("before its first"))));
  EXPECT_EQ(TheJob().state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(TheJob().title(), problem_);
}

TEST_F(InterruptTest, AServerThatEndsIsNoWrongAddress) {
  dlcs::testing::DlcsdProcess server({"--listen", "127.0.0.1:0"});
  RunningProgram program({"solve", problem_, "--server", server.ReadAddress(), "--method", "time-stepping", "--steps",
                          "15000000", "--no-estimate-error", "--at", "0,4"});
  program.AwaitErrorText("15000000 steps");
  server.Signal(SIGKILL);
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 3) << outcome.out;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("was lost"), HasSubstr("dlcs submit"), Not(HasSubstr("Check host"))));
}

TEST_F(InterruptTest, ASolveOfAServerWithoutJobsIsShownAsOneHere) {
  StartServer("");
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string path = folder_.File("result.json");
    RunningProgram program({"solve", problem_, "--server", server_->address(), "--method", "time-stepping", "--steps",
                            "15000000", "--no-estimate-error", "--at", "0,4", "--format", "json", "--output", path},
                           {.variables = {{"TERM", "xterm"}}, .columns = 100});
    program.AwaitErrorText("t = 0.");  // it has begun
    program.Send({signal});
    const ProgramOutcome outcome = program.Await();
    EXPECT_EQ(outcome.code, 128 + signal) << outcome.out;
    std::ifstream stream(path + ".partial");
    const auto root = nlohmann::json::parse(stream);
    EXPECT_EQ(root["summary"]["termination"], "TERMINATION_CANCELLED");
    EXPECT_THAT(root["summary"]["message"].get<std::string>(), HasSubstr("The caller cancelled it"));
    EXPECT_EQ(root["trajectory"]["times"], nlohmann::json({0.0}));
    EXPECT_EQ(root["trajectory"]["x"], nlohmann::json({1.0}));
    EXPECT_LT(root["summary"]["certificate"]["node_residual"].get<double>(), 1e-10);
  }
}

TEST_F(InterruptTest, MembersThatRunOnAServerAreStoppedAndTold) {
  StartServer("");
  const std::string members = folder_.File("members.json");
  std::ofstream(members) << R"json([{"label": "short", "T": 1e-3}, {"label": "long"}])json";
  RunningProgram program({"ensemble", problem_, members, "--server", server_->address(), "--method", "time-stepping",
                          "--step", "3e-7", "--no-estimate-error", "--at", "0", "--format", "csv", "--threads", "2"},
                         {.variables = {{"TERM", "dumb"}}, .columns = 200});
  program.AwaitErrorText("0,short,0,1");
  program.Send({SIGINT});
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 130);
  // The server reports it: otherwise nothing would be known of the member that was running.
  EXPECT_THAT(outcome.out, HasSubstr("1 reached T, 1 stopped"));
}

TEST_F(InterruptTest, WatchingEndsAndTheJobGoesOn) {
  StartServerWithJobs();
  for (const int signal : {SIGINT, SIGTERM}) {
    std::vector<std::string> arguments = {"--server", server_->address()};
    const bool submits = signal == SIGINT;
    const std::vector<std::string> words =
        submits
            ? std::vector<std::string>{"submit", problem_, "--wait", "--method", "time-stepping", "--steps", "15000000"}
            : std::vector<std::string>{"watch", TheJob().name()};
    arguments.insert(arguments.begin(), words.begin(), words.end());
    RunningProgram program(arguments);
    program.AwaitErrorText("running");
    program.Send({signal});
    const ProgramOutcome outcome = program.Await();
    const v1::SolveJob job = TheJob();
    EXPECT_EQ(outcome.code, 128 + signal) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(job.name() + " continues"));
    EXPECT_EQ(job.state(), v1::JOB_STATE_RUNNING);
  }
  EXPECT_TRUE(client_->jobs().Cancel(TheJob().name(), {}).ok());
}

}  // namespace
}  // namespace dlcs::client
