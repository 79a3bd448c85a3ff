// SPDX-License-Identifier: Apache-2.0
// Several servers on one PostgreSQL: what one does the others see.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/jobs/job_manager.h"
#include "server/store/postgres/postgres_job_store.h"
#include "tests/server/jobs/fake_solve.h"
#include "tests/server/jobs/job_follower.h"
#include "tests/server/store/postgres/postgres_server.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::ElementsAre;
using testing::FakeSolve;
using testing::JobFollower;
using testing::PostgresServer;
using testing::Trajectory;

class PostgresServersTest : public ::testing::Test {
 protected:
  struct Server {
    PostgresJobStore store;
    JobManager manager;
    Server(const std::string& address, const JobManagerOptions& options)
        : store({.address = address}), manager(options, store, &Cost, FakeSolve, SystemClock()) {}
  };
  ~PostgresServersTest() override { PostgresServer::Shared().Execute("DROP SCHEMA servers CASCADE"); }

  static absl::StatusOr<Demand> Cost(const Submission&) {
    return Demand{.core_seconds = 0.01, .memory_bytes = 1000, .threads = 1};
  }
  // Looks at what others did only when it is told: what these tests wait for is told.
  JobManagerOptions Named(const std::string& name) const {
    JobManagerOptions options;
    options.worker = name;
    options.limits.cores = 2;
    options.poll = 1h;
    return options;
  }
  std::unique_ptr<Server> Start(const JobManagerOptions& options) const {
    return std::make_unique<Server>(address_, options);
  }
  std::unique_ptr<Server> StartFront() const {
    JobManagerOptions options = Named("front");
    options.runs_jobs = false;
    return Start(options);
  }
  static JobId Submit(Server& server, const std::string& body) {
    Submission submission;
    submission.owner = "ada";
    submission.body = body;
    const auto created = server.manager.Submit(submission);
    EXPECT_TRUE(created.ok()) << created.status();
    return created.ok() ? created->job.id : "";
  }

  const std::string address_ = PostgresServer::Shared().AddressOf("servers");
};

TEST_F(PostgresServersTest, AFrontTakesWhatAWorkerRuns) {
  const auto front = StartFront();
  const auto worker = Start(Named("worker"));
  const JobId id = Submit(*front, "3 4 100");
  JobFollower follower(front->manager, id);
  follower.Read();
  EXPECT_TRUE(follower.ended);
  EXPECT_THAT(follower.durable,
              ElementsAre("QUEUED", "RUNNING", "analysis", "window 0", "window 1", "window 2", "SUCCEEDED", "solved"));
  EXPECT_EQ(Trajectory(front->store, id), Trajectory(3));
}

// What is not in the store reaches those who watch elsewhere all the same, with the detail that they want.
TEST_F(PostgresServersTest, AFrontTellsWhatPassesAtTheWorker) {
  const auto front = StartFront();
  const JobId id = Submit(*front, "wait");
  JobFollower early(front->manager, id, {.detail = {.most_times = 65, .components = {}}});
  early.Read([](const Event& event) { return *event.payload == "QUEUED"; });
  const auto worker = Start(Named("worker"));
  int detailed = 0;
  early.Read([&](const Event& event) { return (detailed += event.payload->ends_with(", 65 values")) == 3; });
  JobFollower late(front->manager, id);
  late.Read([](const Event& event) { return event.kind == EventKind::kIterate; });
  ASSERT_TRUE(front->manager.Cancel("ada", id).ok());
  early.Read();
  late.Read();
  const auto durable = ElementsAre("QUEUED", "RUNNING", "analysis", "CANCELLING", "CANCELLED", ::testing::_);
  EXPECT_THAT(early.durable, durable);
  EXPECT_THAT(late.durable, durable);
}

TEST_F(PostgresServersTest, AFrontAloneTakesJobsAndRunsNone) {
  const auto front = StartFront();
  const JobId id = Submit(*front, "1 1 1");
  EXPECT_EQ(front->store.Get("ada", id)->state, JobState::kQueued);
  const auto worker = Start(Named("worker"));
  JobFollower follower(front->manager, id);
  follower.Read();
  EXPECT_THAT(follower.durable, Contains("SUCCEEDED"));
}

TEST_F(PostgresServersTest, ACancelReachesTheWorkerAtOnce) {
  const auto front = StartFront();
  const auto worker = Start(Named("worker"));
  const JobId id = Submit(*front, "wait");
  JobFollower follower(front->manager, id);
  follower.Read([](const Event& event) { return *event.payload == "RUNNING"; });
  ASSERT_TRUE(front->manager.Cancel("ada", id).ok());
  follower.Read();
  EXPECT_THAT(follower.durable, Contains("CANCELLED"));
}

TEST_F(PostgresServersTest, AJobOfAServerThatDrainsGoesOnAtAnother) {
  auto one = Start(Named("one"));
  const JobId id = Submit(*one, "40 5 500");
  {
    JobFollower follower(one->manager, id);
    follower.Read([](const Event& event) { return *event.payload == "window 1"; });
  }
  const auto other = Start(Named("other"));
  one->manager.Drain(0ms);
  JobFollower follower(other->manager, id);
  follower.Read();
  EXPECT_THAT(follower.durable, Contains("SUCCEEDED"));
  EXPECT_EQ(Trajectory(other->store, id), Trajectory(40));
  EXPECT_EQ(other->store.Get("ada", id)->attempts, 1);
}

TEST_F(PostgresServersTest, ManyJobsAreSharedAndEachIsRunOnce) {
  const auto front = StartFront();
  const auto one = Start(Named("one"));
  const auto other = Start(Named("other"));
  std::vector<JobId> ids;
  for (int k = 0; k < 40; ++k) ids.push_back(Submit(*front, "2 1 200"));
  for (const JobId& id : ids) {
    JobFollower follower(front->manager, id);
    follower.Read();
    EXPECT_THAT(follower.durable,
                ElementsAre("QUEUED", "RUNNING", "analysis", "window 0", "window 1", "SUCCEEDED", "solved"));
    EXPECT_EQ(Trajectory(front->store, id), Trajectory(2));
  }
}

}  // namespace
}  // namespace dlcs::jobs
