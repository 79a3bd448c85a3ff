// SPDX-License-Identifier: Apache-2.0
// A front and two workers on one PostgreSQL. One of the workers, the front or the database is killed at random moments:
// nothing acknowledged is lost, nothing is delivered twice, and the bits are those of undisturbed solves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/service_fixture.h"
#include "tests/server/solve_jobs/fleet_server.h"
#include "tests/server/solve_jobs/followed_jobs.h"
#include "tests/server/store/postgres/postgres_server.h"
#include "tests/server/store/random_kills.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using jobs::testing::PostgresServer;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::AllOf;
using testing::DlcsdProcess;
using Server = testing::FleetServer;
using ::testing::HasSubstr;

constexpr std::size_t kUnfinished = 5;  // jobs at any time
// Longer than the lease.
constexpr int kLongestAbsenceMs = 1500;

bool IsServing(const std::shared_ptr<grpc::Channel>& channel, const std::string& service) {
  grpc::ClientContext context;
  grpc::health::v1::HealthCheckRequest request;
  grpc::health::v1::HealthCheckResponse response;
  request.set_service(service);
  return grpc::health::v1::Health::NewStub(channel)->Check(&context, request, &response).ok() &&
         response.status() == grpc::health::v1::HealthCheckResponse::SERVING;
}

TEST(JobClusterTest, AWorkerRunsJobsAndTakesNoCalls) {
  PostgresServer database;
  Server worker("worker", "one", database.address());
  const auto channel = testing::Connect(worker.address());

  for (const std::string service : {"", "dlcs.v1.JobService"}) {
    const auto give_up = steady_clock::now() + seconds(60);
    while (!IsServing(channel, service) && steady_clock::now() < give_up) std::this_thread::sleep_for(milliseconds(10));
    EXPECT_TRUE(IsServing(channel, service)) << service;
  }
  grpc::ClientContext context;
  v1::SolveJob job;
  const grpc::Status status = v1::JobService::NewStub(channel)->CreateSolveJob(&context, {}, &job);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_THAT(status.error_message(), HasSubstr("--role worker"));
  EXPECT_EQ(testing::Solve(*v1::SolverService::NewStub(channel), testing::SwitchingRequest(10)).status.error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST(JobClusterTest, AWorkerEndsWhenThereIsNothingToDo) {
  PostgresServer database;
  Server front("front", "front", database.address());
  testing::FollowedJobs jobs(front.address(), seconds(100));
  jobs.Submit(testing::SteppingRequest(200'000));
  const auto begin = steady_clock::now();
  DlcsdProcess worker({"--listen", "127.0.0.1:0", "--store", database.address(), "--role", "worker", "--worker-name",
                       "one", "--exit-when-idle", "1.5s"});
  EXPECT_EQ(worker.Wait(), 0);
  EXPECT_GE(steady_clock::now() - begin, milliseconds(1500));
  EXPECT_THAT(worker.ReadErrors(), AllOf(HasSubstr("job finished"), HasSubstr("no job to claim: shutting down")));
  jobs.ExpectAllSucceed();
}

TEST(JobClusterTest, AWorkerThatIsToldToEndGivesItsJobBackAtOnce) {
  PostgresServer database;
  Server front("front", "front", database.address());
  testing::FollowedJobs jobs(front.address(), seconds(100));
  // The lease is too long to wait for.
  const auto flags = [&](const std::string& name) {
    return std::vector<std::string>{"--listen",   "127.0.0.1:0", "--store",         database.address(),
                                    "--role",     "worker",      "--worker-name",   name,
                                    "--lease-ms", "3600000",     "--checkpoint-ms", "10"};
  };
  DlcsdProcess first(flags("one"));
  ASSERT_NE(first.ReadAddress(), "");
  jobs.Submit(testing::SteppingRequest(3'000'000));
  std::this_thread::sleep_for(milliseconds(500));
  first.Signal(SIGTERM);
  EXPECT_EQ(first.Wait(), 0);
  EXPECT_THAT(first.ReadErrors(), HasSubstr("job interrupted"));
  DlcsdProcess second(flags("two"));
  jobs.ExpectAllSucceed();
}

TEST(JobClusterTest, KilledWorkersFrontsAndDatabasesLoseNothingAndRepeatNothing) {
  // Of this seed: the front, a worker for longer than its lease, the database, the other worker.
  const jobs::testing::RandomKills kills(4, 36);
  std::mt19937 random(kills.seed);
  SCOPED_TRACE(kills.trace());

  PostgresServer database;
  Server front("front", "front", database.address());
  Server workers[] = {{"worker", "one", database.address()}, {"worker", "two", database.address()}};
  testing::FollowedJobs jobs(front.address(), seconds(60 + 3 * kills.count));

  std::uniform_int_distribution<int> pause_ms(5, 400), absence_ms(0, kLongestAbsenceMs), victim(0, 9);
  steady_clock::time_point back;  // of the worker that is away
  for (int kill = 0; kill < kills.count; ++kill) {
    while (jobs.unfinished() < kUnfinished) {
      // If the response is lost, the request is sent again and still creates one job.
      const int size = static_cast<int>(jobs.size());
      jobs.Submit(size % 2 == 0 ? testing::SteppingRequest(60'000 + 1000 * (size % 24))
                                : testing::SwitchingRequest(20'000 + size));
    }
    std::this_thread::sleep_for(milliseconds(pause_ms(random)));
    for (Server& worker : workers) {
      if (worker.is_up()) continue;
      std::this_thread::sleep_until(back);
      worker.Start();
    }
    switch (const int chosen = victim(random)) {
      case 0:
        front.Kill();
        front.Start();
        break;
      case 1:
      case 2:
      case 3:
        database.Kill();
        database.Start();
        break;
      default:
        workers[chosen % 2].Kill();
        back = steady_clock::now() + milliseconds(absence_ms(random));
    }
  }
  // At the end one worker may be away for good.
  jobs.ExpectAllSucceed();
  RecordProperty("jobs", std::to_string(jobs.size()));
}

}  // namespace
}  // namespace dlcs
