// SPDX-License-Identifier: Apache-2.0
// Solves that are jobs: created, watched and read in one call, which may be cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "client/rpc/client.h"
#include "server/rpc/job_solve_call.h"
#include "spdlog/spdlog.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/service_fixture.h"
#include "tests/server/solve_jobs/job_runs.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using client::Client;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::Outcome;
using ::testing::StartsWith;
using testing::SteppingRequest;
using testing::SwitchingRequest;

v1::SolveRequest AsJob(v1::SolveRequest request, const std::string& request_id = "mine") {
  request.set_request_id(request_id);
  return request;
}

// Of some seconds, with a small result that begins early.
v1::SolveRequest LongSolve() {
  v1::SolveRequest request = AsJob(SteppingRequest(15'000'000));
  for (const double time : {0.001, 5.0, 10.0}) request.mutable_options()->add_output_times(time);
  return request;
}

// The concatenated chunks of the trajectory. The test fails if they do not continue each other.
testing::Trajectory TrajectoryOf(const std::vector<v1::SolveEvent>& events) {
  testing::Trajectory result;
  for (const v1::SolveEvent& event : events) {
    const v1::TrajectoryChunk& chunk = event.trajectory();
    if (chunk.times_size() == 0) continue;
    EXPECT_EQ(chunk.first(), static_cast<std::int64_t>(result.times.size()));
    result.times.insert(result.times.end(), chunk.times().begin(), chunk.times().end());
    result.x.insert(result.x.end(), chunk.x().begin(), chunk.x().end());
    result.y.insert(result.y.end(), chunk.y().begin(), chunk.y().end());
    result.w.insert(result.w.end(), chunk.w().begin(), chunk.w().end());
  }
  return result;
}

class JobSolveTest : public testing::ServiceTest {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    ServerConfig config;
    config.store = folder_.File("jobs.db");
    config.checkpoint_ms = 20;
    StartServer(config);
    client_ = *Client::Connect(server_->address());
  }

  std::size_t CountJobs() { return client_->jobs().List({}, 100, {})->size(); }

  jobs::testing::TemporaryFolder folder_;
  std::unique_ptr<Client> client_;
};

TEST_F(JobSolveTest, GivesTheBitsOfASolveAndNamesItsJobFirst) {
  for (const v1::SolveRequest& request : {SwitchingRequest(3000), SteppingRequest(100'000 / testing::kSlowness)}) {
    const Outcome outcome = testing::Solve(*stub_, AsJob(request, request.options().DebugString().substr(0, 100)));
    ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    ASSERT_GT(outcome.events.size(), 3u);
    const v1::Accepted& accepted = outcome.events.front().accepted();
    EXPECT_THAT(accepted.job(), StartsWith("jobs/"));
    EXPECT_EQ(accepted.states(), 1);
    EXPECT_EQ(accepted.constraints(), 1);
    EXPECT_EQ(testing::Count(outcome.events, v1::SolveEvent::kAnalysis), 1);
    EXPECT_EQ(outcome.events.back().summary().termination(), v1::TERMINATION_REACHED_END);
    EXPECT_EQ(testing::Count(outcome.events, v1::SolveEvent::kSummary), 1);
    std::int64_t last = 0;
    for (const v1::SolveEvent& event : outcome.events) {
      EXPECT_GE(event.sequence(), last);
      last = event.sequence();
    }
    testing::ExpectSameTrajectory(TrajectoryOf(outcome.events), testing::SolveHere(request));
    EXPECT_EQ(client_->jobs().Get(accepted.job(), {})->state(), v1::JOB_STATE_SUCCEEDED);
  }
}

// z' = -z + 1000 (a - b), with a and b equal but for 1e-9: of 1e-9 of z, rounding leaves nothing.
TEST_F(JobSolveTest, AbsoluteTolerancesAreThoseOfTheRequestAsAJobToo) {
  v1::SolveRequest request;
  v1::Problem& problem = *request.mutable_problem();
  *problem.mutable_a() = testing::DenseMatrix(3, 3, {-1, 0, 0, 0, -1, 0, 1e3, -1e3, -1});
  *problem.mutable_b() = testing::DenseMatrix(3, 1, {0, 0, 0});
  *problem.mutable_n() = testing::DenseMatrix(1, 3, {0, 0, 0});
  *problem.mutable_m() = testing::DenseMatrix(1, 1, {1});
  for (const char* f : {"sin(t)", "sin(t)", "0"}) {
    auto& pieces = *problem.mutable_f()->mutable_pieces();
    if (pieces.empty()) pieces.Add();
    pieces[0].mutable_formulas()->add_formulas(f);
  }
  problem.mutable_g()->add_pieces()->mutable_formulas()->add_formulas("1");
  for (const double x0 : {1.0, 1 + 1e-9, 0.0}) problem.add_x0(x0);
  for (const char* name : {"a", "b", "z"}) problem.add_state_names(name);
  problem.set_horizon(5);
  request.mutable_options()->set_error_tolerance(1e-8);
  const auto verdict = [&](const std::string& request_id) {
    const Outcome outcome = testing::Solve(*stub_, request_id.empty() ? request : AsJob(request, request_id));
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    return outcome.events.empty() ? v1::Verdict() : outcome.events.back().summary().verdict();
  };
  EXPECT_EQ(verdict("").kind(), v1::VERDICT_KIND_ERROR_ESTIMATED);
  EXPECT_EQ(verdict("missed").kind(), v1::VERDICT_KIND_ERROR_ESTIMATED);
  v1::ComponentTolerance& of_z = *request.mutable_options()->add_absolute_tolerances();
  of_z.set_name("z");
  of_z.set_tolerance(1e-9);
  EXPECT_EQ(verdict("").kind(), v1::VERDICT_KIND_SOLVED);
  EXPECT_EQ(verdict("accepted").kind(), v1::VERDICT_KIND_SOLVED);
  of_z.set_name("Z");
  const grpc::Status refused = testing::Solve(*stub_, request).status;
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("absolute_tolerances[0].name: \"Z\"; is no state, pair or output of "
                                                 "the problem, which has a, b, z, y1, w1; did you mean z?"));
}

TEST_F(JobSolveTest, WhoComesBackWithTheRequestIdIsGivenTheSameSolve) {
  const v1::SolveRequest request = AsJob(SwitchingRequest(500));
  const Outcome first = testing::Solve(*stub_, request);
  const Outcome again = testing::Solve(*stub_, request);
  ASSERT_TRUE(again.status.ok()) << again.status.error_message();
  EXPECT_EQ(again.events.front().accepted().job(), first.events.front().accepted().job());
  testing::ExpectSameTrajectory(TrajectoryOf(again.events), TrajectoryOf(first.events));
  EXPECT_EQ(CountJobs(), 1u);
  EXPECT_EQ(testing::Solve(*stub_, AsJob(SwitchingRequest(501))).status.error_code(), grpc::StatusCode::ALREADY_EXISTS);
}

TEST_F(JobSolveTest, WithoutARequestIdItIsNoJob) {
  const Outcome outcome = testing::Solve(*stub_, SwitchingRequest(100));
  ASSERT_TRUE(outcome.status.ok());
  EXPECT_EQ(outcome.events.front().accepted().job(), "");
  EXPECT_EQ(CountJobs(), 0u);
  StartServer(ServerConfig());
  const Outcome without_store = testing::Solve(*stub_, AsJob(SwitchingRequest(100)));
  ASSERT_TRUE(without_store.status.ok()) << without_store.status.error_message();
  EXPECT_EQ(without_store.events.front().accepted().job(), "");
}

TEST_F(JobSolveTest, RefusalsAreThoseOfAJob) {
  v1::SolveRequest request = AsJob(SwitchingRequest(100));
  request.mutable_problem()->set_horizon(-1);
  EXPECT_EQ(testing::Solve(*stub_, request).status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  request = AsJob(SwitchingRequest(100), std::string(129, 'x'));
  const grpc::Status status = testing::Solve(*stub_, request).status;
  EXPECT_THAT(status.error_message(), HasSubstr("request_id: has 129 bytes"));
  EXPECT_EQ(CountJobs(), 0u);
}

TEST_F(JobSolveTest, TheDeadlineLeavesAnAnswer) {
  // Predicted by its steps, about a microsecond each; in truth each is a window with several iterates.
  v1::SolveRequest request = testing::ChattyRequest(600'000);
  request.mutable_options()->add_output_times(10);  // how long a large trajectory takes is another question
  const Outcome outcome = testing::Solve(*stub_, AsJob(request), milliseconds(1500));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.events.back().summary().termination(), v1::TERMINATION_DEADLINE)
      << outcome.events.back().summary().message();
}

TEST_F(JobSolveTest, ACutDoesNotEndItAndCancelDoes) {
  grpc::ClientContext context;
  const auto reader = stub_->Solve(&context, LongSolve());
  v1::SolveEvent event;
  ASSERT_TRUE(reader->Read(&event));
  const std::string job = event.accepted().job();
  while (!event.has_analysis()) ASSERT_TRUE(reader->Read(&event));
  context.TryCancel();
  while (reader->Read(&event)) {
  }
  reader->Finish();
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(client_->jobs().Get(job, {})->state(), v1::JOB_STATE_RUNNING);

  std::thread canceller([&] {
    std::this_thread::sleep_for(milliseconds(100));
    EXPECT_TRUE(client_->jobs().Cancel(job, {}).ok());
  });
  const Outcome outcome = testing::Solve(*stub_, LongSolve());
  canceller.join();
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.events.back().summary().termination(), v1::TERMINATION_CANCELLED);
  EXPECT_GT(TrajectoryOf(outcome.events).times.size(), 0u);
}

// A real server, killed and started again while a client follows a solve.
TEST(JobSolveKillTest, TheClientFollowsItsSolveOverKilledServers) {
  const jobs::testing::TemporaryFolder folder;
  std::string listen = "127.0.0.1:0";
  std::unique_ptr<testing::DlcsdProcess> server;
  const auto start = [&] {
    server = std::make_unique<testing::DlcsdProcess>(std::vector<std::string>{
        "--listen", listen, "--store", folder.File("jobs.db"), "--checkpoint-ms", "10", "--log-level", "off"});
    listen = server->ReadAddress();
    ASSERT_NE(listen, "");
  };
  start();
  for (const v1::SolveRequest& request : {SteppingRequest(600'000), SwitchingRequest(400'000)}) {
    std::atomic<int> notices = 0;
    const auto client = *client::Client::Connect(listen, [&](const std::string&) { ++notices; });
    std::atomic<bool> accepted = false, ended = false;
    absl::StatusOr<client::SolveResult> result = absl::UnknownError("");
    std::atomic<int> summaries = 0, trajectory_events = 0;
    std::thread solving([&] {
      result = client->Solve(AsJob(request, "solve " + std::to_string(request.options().steps())),
                             [&](const v1::SolveEvent& event) {
                               if (event.has_accepted()) accepted = true;
                               if (event.has_summary()) ++summaries;
                               if (event.has_trajectory()) ++trajectory_events;
                             },
                             {.deadline = seconds(120), .stop = {}});
      ended = true;
    });
    // A client that did not receive the name of the job cannot resume it.
    while (!accepted && !ended) std::this_thread::sleep_for(milliseconds(5));
    for (int kill = 0; kill < 2 && !ended; ++kill) {
      std::this_thread::sleep_for(milliseconds(150));
      server->Signal(kill == 1 ? SIGTERM : SIGKILL);  // a rolling restart among them
      server->Wait();
      start();
    }
    solving.join();
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->summary.termination(), v1::TERMINATION_REACHED_END) << result->summary.message();
    EXPECT_GT(notices, 0);
    EXPECT_EQ(summaries, 1);
    EXPECT_GT(trajectory_events, 0);
    testing::ExpectSameTrajectory({result->times, result->x, result->y, result->w}, testing::SolveHere(request));
    EXPECT_TRUE((*Client::Connect(listen))->jobs().List({}, 10, {})->empty()) << "of no use any more";
  }
}

}  // namespace
}  // namespace dlcs
