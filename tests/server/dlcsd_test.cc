// SPDX-License-Identifier: Apache-2.0
// The program itself: its lines, its exit status, its signals, its memory.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/session/version.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/service_fixture.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using testing::Count;
using testing::DlcsdProcess;
using ::testing::HasSubstr;
using testing::Outcome;

std::unique_ptr<v1::SolverService::Stub> NewStub(const std::string& address) {
  return v1::SolverService::NewStub(testing::Connect(address));
}

TEST(DlcsdTest, PrintsOneLineWhenReadyAndEndsOnSigterm) {
  DlcsdProcess dlcsd({"--listen", "127.0.0.1:0"});
  const std::string address = dlcsd.ReadAddress();
  ASSERT_NE(address, "");
  EXPECT_NE(address, "127.0.0.1:0");
  const Outcome outcome = testing::Solve(*NewStub(address), testing::SwitchingRequest(100));
  EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  dlcsd.Signal(SIGTERM);
  EXPECT_EQ(dlcsd.ReadLine(), "");
  EXPECT_EQ(dlcsd.Wait(), 0);
  const std::string log = dlcsd.ReadErrors();
  EXPECT_THAT(log, HasSubstr("info solve finished solve=" + outcome.events[0].accepted().solve_id() +
                             " states=1 constraints=1 steps=100 method="));
  EXPECT_THAT(log, HasSubstr(" termination=REACHED_END seconds="));
}

// A solve on a server that the test will stop. After construction the engine is running.
class RunningSolve {
 public:
  RunningSolve(v1::SolverService::Stub& stub, std::int64_t steps) {
    testing::SetDeadline(context_, seconds(100));
    reader_ = stub.Solve(&context_, testing::SteppingRequest(steps));
    while (reader_->Read(&event_) && !event_.has_analysis()) {
    }
  }
  // The summary; empty when the call failed.
  v1::Summary ReadToEnd() {
    while (reader_->Read(&event_)) {
    }
    EXPECT_TRUE(reader_->Finish().ok());
    return event_.summary();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::SolveEvent>> reader_;
  v1::SolveEvent event_;
};

TEST(DlcsdTest, SolvesUnderWayEndWithinTheGracePeriod) {
  DlcsdProcess dlcsd({"--listen", "127.0.0.1:0", "--grace", "60"});
  const auto stub = NewStub(dlcsd.ReadAddress());
  RunningSolve solve(*stub, 1'000'000);
  dlcsd.Signal(SIGTERM);
  EXPECT_EQ(solve.ReadToEnd().termination(), v1::TERMINATION_REACHED_END);
  EXPECT_EQ(dlcsd.Wait(), 0);
}

TEST(DlcsdTest, SolvesAreStoppedAfterTheGracePeriodAndTellTheirSummary) {
  DlcsdProcess dlcsd({"--listen", "127.0.0.1:0", "--grace", "0.3"});
  const auto stub = NewStub(dlcsd.ReadAddress());
  RunningSolve solve(*stub, 20'000'000);
  dlcsd.Signal(SIGTERM);
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(testing::Solve(*stub, testing::SwitchingRequest(10)).status.error_code(), grpc::StatusCode::UNAVAILABLE);
  // The summary reports that the solve was stopped.
  const v1::Summary summary = solve.ReadToEnd();
  EXPECT_EQ(summary.termination(), v1::TERMINATION_CANCELLED);
  EXPECT_THAT(summary.message(), HasSubstr("shutting down"));
  EXPECT_EQ(dlcsd.Wait(), 0);
}

TEST(DlcsdTest, ASecondSignalSkipsTheGracePeriod) {
  DlcsdProcess dlcsd({"--listen", "127.0.0.1:0", "--grace", "3600"});
  const auto stub = NewStub(dlcsd.ReadAddress());
  RunningSolve solve(*stub, 20'000'000);
  dlcsd.Signal(SIGINT);
  std::this_thread::sleep_for(milliseconds(200));
  dlcsd.Signal(SIGINT);
  EXPECT_EQ(solve.ReadToEnd().termination(), v1::TERMINATION_CANCELLED);
  EXPECT_EQ(dlcsd.Wait(), 0);
}

// Hundreds of thousands of windows. Nobody reads for five seconds.
TEST(DlcsdTest, AClientThatStopsReadingNeitherStallsTheEngineNorGrowsTheServer) {
  DlcsdProcess dlcsd({"--listen", "127.0.0.1:0"});
  const auto stub = NewStub(dlcsd.ReadAddress());
  ASSERT_TRUE(testing::Solve(*stub, testing::ChattyRequest(1000)).status.ok());  // warms allocators and pools

  constexpr std::int64_t kSteps = 300'000 / testing::kSlowness;
  constexpr std::int64_t kTrajectoryBytes = kSteps * 3 * 8;
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(200));
  const std::int64_t before = dlcsd.ResidentBytes();
  const auto reader = stub->Solve(&context, testing::ChattyRequest(kSteps));
  std::int64_t most = 0;
  for (const auto end = steady_clock::now() + seconds(5); steady_clock::now() < end;) {
    most = std::max(most, dlcsd.ResidentBytes());
    std::this_thread::sleep_for(milliseconds(20));
  }

  std::vector<v1::SolveEvent> events;
  for (v1::SolveEvent event; reader->Read(&event);) events.push_back(event);
  const grpc::Status status = reader->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
  const v1::Summary& summary = events.back().summary();
  EXPECT_EQ(summary.termination(), v1::TERMINATION_REACHED_END);
  EXPECT_EQ(summary.times(), kSteps + 1);
  if (testing::kSlowness > 1) return;  // too few events to fill anything, and sanitizers keep freed memory
  EXPECT_GT(summary.conflated_iterates(), 0);
  EXPECT_GT(Count(events, v1::SolveEvent::kGap), 0);
  // Memory may grow by the buffer (3 MB), the messages in transit in gRPC, and the trajectory itself, of which the
  // engine holds a few copies while it solves. All events together would take several times that.
  const std::int64_t all_events = events.back().sequence() * 250;
  const std::int64_t allowed = 4 * kTrajectoryBytes + 20'000'000;
  ASSERT_GT(all_events, 3 * allowed);
  EXPECT_LT(most - before, allowed);
  RecordProperty("resident_growth_bytes", std::to_string(most - before));
}

TEST(DlcsdTest, TakenPortsUnknownHostsAndBadFlagsAreClearErrors) {
  DlcsdProcess first({"--listen", "127.0.0.1:0"});
  const std::string address = first.ReadAddress();
  struct Case {
    std::vector<std::string> flags;
    int exit_status;
    std::string words;
  };
  const std::vector<Case> cases = {
      {{"--listen", address}, 3, address + ": the port is taken"},
      {{"--listen", "no-such-host.invalid:1"}, 2, "unknown host no-such-host.invalid"},
      {{"--listen", "here"}, 2, "\"here\" is not HOST:PORT"},
      {{"--max-steps", "0"}, 2, "--max-steps 0: must be at least 1"},
      {{"--max-stepz", "7"}, 2, "--max-stepz"},
      {{"--log-level", "loud"}, 2, "--log-level"},
      {{"--role", "boss"}, 2, "--role: \"boss\" is none of all, front, worker"},
      {{"--role", "front", "--store", "jobs.db"}, 2, "--role front: needs a shared store"},
      {{"--store", "postgresql://dlcs:p@ss@db/jobs"}, 2, "--store: not an address as postgresql://"},
      {{"--lease-ms", "10"}, 2, "--lease-ms 10: must be between 1000 and 3600000"},
  };
  for (const Case& wrong : cases) {
    DlcsdProcess dlcsd(wrong.flags);
    EXPECT_EQ(dlcsd.ReadLine(), "");
    EXPECT_EQ(dlcsd.Wait(), wrong.exit_status) << wrong.words;
    EXPECT_THAT(dlcsd.ReadErrors(), HasSubstr(wrong.words));
  }
}

TEST(DlcsdTest, TellsItsVersionAndHelp) {
  DlcsdProcess version({"--version"});
  EXPECT_EQ(version.ReadLine(), "dlcsd " DLCS_VERSION " (" + BuildText() + ")");
  EXPECT_EQ(version.Wait(), 0);
  DlcsdProcess help({"--help"});
  const std::string text = help.ReadOutput();
  EXPECT_EQ(help.Wait(), 0);
  for (const char* words : {"--listen", "--grace", "Examples:", "127.0.0.1:50051"}) {
    EXPECT_THAT(text, HasSubstr(words));
  }
}

}  // namespace
}  // namespace dlcs
