// SPDX-License-Identifier: Apache-2.0
// Several servers on one PostgreSQL: each sees the changes of the others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/jobs/job_manager.h"
#include "server/store/postgres/postgres_job_store.h"
#include "tests/server/jobs/fake_solve.h"
#include "tests/server/jobs/job_follower.h"
#include "tests/server/store/job_samples.h"
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
    std::atomic<int> claims = 0;
    PostgresJobStore store;
    JobManager manager;
    Server(const std::string& address, const JobManagerOptions& options)
        : store({.address = address,
                 .timer = [this](const std::string& operation, const auto&, auto) { claims += operation == "Claim"; }}),
          manager(options, store, &Cost, FakeSolve, SystemClock()) {}
  };
  ~PostgresServersTest() override { PostgresServer::Shared().Execute("DROP SCHEMA servers CASCADE"); }

  static absl::StatusOr<Demand> Cost(const Submission&) {
    return Demand{.core_seconds = 0.01, .memory_bytes = 1000, .threads = 1};
  }
  // Polls so rarely that everything these tests wait for must arrive as a notification.
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

// Events that are not in the store reach the watchers on other servers too, with the detail that they want.
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

// One claim names many jobs, so that all jobs that another server has claimed cost one call together.
TEST_F(PostgresServersTest, JobsThatAnotherServerHasAreNotClaimedOneByOne) {
  const auto front = StartFront();
  std::vector<JobId> ids;
  for (int k = 0; k < 41; ++k) ids.push_back(Submit(*front, k == 0 ? "wait" : "1 1 1"));
  JobManagerOptions options = Named("worker");
  options.limits.cores = 1;
  const auto worker = Start(options);
  JobFollower first(front->manager, ids[0]);
  first.Read([](const Event& event) { return *event.payload == "RUNNING"; });
  // The worker knows all of them.
  for (std::size_t k = 1; k <= 35; ++k) ASSERT_TRUE((*front->store.Claim("other", 1h, {&ids[k], 1})).has_value());
  ASSERT_TRUE(front->manager.Cancel("ada", ids[0]).ok());
  for (std::size_t k = 36; k < ids.size(); ++k) {
    JobFollower follower(front->manager, ids[k]);
    follower.Read();
    EXPECT_THAT(follower.durable, ElementsAre("QUEUED", "RUNNING", "analysis", "window 0", "SUCCEEDED", "solved"));
  }
  EXPECT_LE(worker->claims, 6 + 4);
  EXPECT_EQ(front->store.Get("ada", ids[1])->state, JobState::kRunning);
}

// Every server receives every notification, so events are announced only for jobs that some server follows, including
// events from shortly before it began to follow.
TEST_F(PostgresServersTest, EventsAreToldOfJobsThatAreFollowed) {
  PostgresJobStore follower({.address = address_});
  PostgresJobStore worker({.address = address_});
  std::mutex mutex;
  std::condition_variable heard;
  std::vector<std::pair<JobChange::What, JobId>> changes;
  bool is_listening = false;
  follower.Subscribe([&](const JobChange& change) {
    const std::lock_guard lock(mutex);
    is_listening = true;
    if (change.what != JobChange::What::kUnknown) changes.emplace_back(change.what, change.job);
    heard.notify_one();
  });
  bool worker_is_listening = false;
  worker.Subscribe([&](const JobChange&) {
    const std::lock_guard lock(mutex);
    worker_is_listening = true;
    heard.notify_one();
  });
  const auto hears = [&](JobChange::What what, const JobId& id) {
    std::unique_lock lock(mutex);
    return heard.wait_for(lock, 30s, [&] { return std::ranges::count(changes, std::pair(what, id)) > 0; });
  };
  const auto forget = [&] {
    const std::lock_guard lock(mutex);
    changes.clear();
  };
  {
    std::unique_lock lock(mutex);
    ASSERT_TRUE(heard.wait_for(lock, 30s, [&] { return is_listening && worker_is_listening; }));
  }
  const JobId one[] = {follower.Create(testing::SampleJob())->job.id};
  EXPECT_TRUE(hears(JobChange::What::kClaimable, one[0]));
  const auto claimed = worker.Claim("w", 1h, one);
  ASSERT_TRUE(claimed.ok() && claimed->has_value());
  ASSERT_TRUE(worker.Append((*claimed)->lease, testing::SampleWindow(0, 10)).ok());
  ASSERT_TRUE(worker.RequestCancel("ada", one[0]).ok());
  EXPECT_TRUE(hears(JobChange::What::kCancelling, one[0]));  // by a statement after all of that
  EXPECT_EQ(std::ranges::count(changes, std::pair(JobChange::What::kEvents, one[0])), 0);
  follower.Publish({.what = JobChange::What::kFollowed, .job = one[0]});
  EXPECT_TRUE(hears(JobChange::What::kEvents, one[0])) << "of what was before";
  forget();
  ASSERT_TRUE(worker.Append((*claimed)->lease, testing::SampleWindow(1, 20)).ok());
  EXPECT_TRUE(hears(JobChange::What::kEvents, one[0]));
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
