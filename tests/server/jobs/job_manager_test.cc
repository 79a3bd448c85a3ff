// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/job_manager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/store/sqlite/sqlite_job_store.h"
#include "spdlog/spdlog.h"
#include "tests/server/jobs/fake_solve.h"
#include "tests/server/jobs/job_follower.h"
#include "tests/server/store/failing_store.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::ElementsAre;
using testing::FakeSolve;
using ::testing::IsEmpty;
using testing::JobFollower;
using testing::Trajectory;

class JobManagerTest : public ::testing::Test {
 protected:
  static JobManagerOptions Fast(const std::string& worker = "one", int cores = 2) {
    JobManagerOptions options;
    options.limits.cores = cores;
    options.worker = worker;
    options.poll = 20ms;
    options.lease = 10s;
    options.probe = 50ms;
    return options;
  }
  std::unique_ptr<JobManager> Start(const JobManagerOptions& options = Fast()) {
    return std::make_unique<JobManager>(options, store_, &Cost, FakeSolve, SystemClock());
  }
  static absl::StatusOr<Demand> Cost(const Submission& asked) {
    const std::string& body = asked.body;
    if (body == "nonsense") return absl::InvalidArgumentError("body: nonsense");
    return Demand{.core_seconds = body == "huge" ? 1e9 : 0.01, .memory_bytes = 1000, .threads = 1};
  }
  static Submission Ask(const std::string& body) {
    Submission submission;
    submission.owner = "ada";
    submission.body = body;
    return submission;
  }
  static JobId Submit(JobManager& manager, const std::string& body) {
    const auto created = manager.Submit(Ask(body));
    EXPECT_TRUE(created.ok()) << created.status();
    return created.ok() ? created->job.id : "";
  }
  // Waits for the end and returns the job.
  Job Wait(JobManager& manager, const JobId& id) {
    JobFollower follower(manager, id);
    follower.Read();
    const auto job = store_.Get("ada", id);
    EXPECT_TRUE(job.ok()) << job.status();
    return *job;
  }
  JobState StateOf(const JobId& id) { return store_.Get("ada", id)->state; }

  testing::TemporaryFolder folder_;
  SqliteJobStore sqlite_{{.path = folder_.File("jobs.db")}, SystemClock()};
  testing::FailingStore store_{sqlite_};
};

TEST_F(JobManagerTest, RunsAJobFromQueueToSummary) {
  const auto manager = Start();
  EXPECT_TRUE(manager->Healthy());
  const JobId id = Submit(*manager, "3 4 100");
  JobFollower follower(*manager, id);
  follower.Read();
  EXPECT_THAT(follower.durable,
              ElementsAre("QUEUED", "RUNNING", "analysis", "window 0", "window 1", "window 2", "SUCCEEDED", "solved"));
  EXPECT_TRUE(follower.ended);
  EXPECT_EQ(StateOf(id), JobState::kSucceeded);
  EXPECT_EQ(Trajectory(store_, id), Trajectory(3));
  EXPECT_EQ(manager->load().queued, 0);
}

TEST_F(JobManagerTest, AWatcherWhoComesLateGetsTheDurableEventsAndTheEnd) {
  const auto manager = Start();
  const JobId id = Submit(*manager, "3 4 100");
  Wait(*manager, id);
  JobFollower late(*manager, id);
  late.Read();
  EXPECT_EQ(late.durable.size(), 8u);
  JobFollower resumed(*manager, id, {.after = 2});
  resumed.Read();
  EXPECT_EQ(resumed.durable.front(), "analysis");
  const std::int64_t end = store_.Get("ada", id)->sequence;
  JobFollower done(*manager, id, {.after = end});
  done.ended = true;
  done.Read();
  EXPECT_THAT(done.durable, IsEmpty());
  EXPECT_EQ(JobFollower(*manager, id, {.after = end + 1}).error().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(JobFollower(*manager, NewJobId()).error().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobManagerTest, TheSameRequestIsOneJobEvenWhenThereIsNoRoom) {
  JobManagerOptions options = Fast("one", 1);
  options.limits.max_queued_jobs = 1;
  const auto manager = Start(options);
  Submission first = Ask("wait");
  first.request_id = "r";
  first.body_hash = "h";
  const JobId id = manager->Submit(first)->job.id;
  JobFollower(*manager, id).Read([](const Event& event) { return *event.payload == "RUNNING"; });
  Submit(*manager, "1 1 1");
  const absl::Status full = manager->Submit(Ask("1 1 1")).status();
  EXPECT_EQ(RefusalOf(full)->limit, "max_queued_jobs");
  const auto again = manager->Submit(first);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->existed);
  EXPECT_EQ(again->job.id, id);
  first.body_hash = "other";
  EXPECT_EQ(manager->Submit(first).status().code(), absl::StatusCode::kAlreadyExists);
  ASSERT_TRUE(manager->Cancel("ada", id).ok());
}

TEST_F(JobManagerTest, RefusesBeforeAnythingIsStored) {
  const auto manager = Start();
  EXPECT_EQ(manager->Submit(Ask("nonsense")).status().code(), absl::StatusCode::kInvalidArgument);
  const absl::Status huge = manager->Submit(Ask("huge")).status();
  EXPECT_EQ(huge.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RefusalOf(huge)->limit, "max_job_core_seconds");
  EXPECT_THAT(store_.List({}, 10, "")->jobs, IsEmpty());
}

TEST_F(JobManagerTest, FailuresAreSaidAndTheServerGoesOn) {
  const auto level = spdlog::get_level();
  spdlog::set_level(spdlog::level::off);  // exceptions are logged
  const auto manager = Start();
  const JobId thrown = Submit(*manager, "throw");
  const JobId failed = Submit(*manager, "fail");
  const JobId good = Submit(*manager, "1 1 1");
  EXPECT_EQ(Wait(*manager, thrown).error.code(), absl::StatusCode::kInternal);
  EXPECT_EQ(StateOf(thrown), JobState::kFailed);
  EXPECT_EQ(Wait(*manager, failed).error, absl::InvalidArgumentError("no such problem"));
  EXPECT_EQ(Wait(*manager, good).state, JobState::kSucceeded);
  spdlog::set_level(level);
}

TEST_F(JobManagerTest, CancelsWhatRunsAndWhatWaits) {
  const auto manager = Start(Fast("one", 1));
  const JobId running = Submit(*manager, "wait");
  const JobId waiting = Submit(*manager, "1 1 1");
  JobFollower follower(*manager, running);
  follower.Read([](const Event& event) { return event.kind == EventKind::kIterate; });
  JobFollower queued(*manager, waiting);
  ASSERT_TRUE(manager->Cancel("ada", waiting).ok());
  queued.Read();
  EXPECT_THAT(queued.durable, ElementsAre("QUEUED", "CANCELLED", ""));
  EXPECT_EQ(manager->Cancel("bob", running).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(manager->Cancel("ada", running)->state, JobState::kCancelling);
  follower.Read();
  EXPECT_THAT(follower.durable,
              ElementsAre("QUEUED", "RUNNING", "analysis", "CANCELLING", "CANCELLED", "stopped in window 0"));
  EXPECT_EQ(StateOf(running), JobState::kCancelled);
  EXPECT_EQ(manager->Cancel("ada", running)->state, JobState::kCancelled);
  manager->Drain(5s);
  EXPECT_EQ(manager->load().running, 0);
}

TEST_F(JobManagerTest, StopsAtTheDeadlineAndGivesUpWhatCannotMeetIt) {
  const auto manager = Start(Fast("one", 1));
  Submission submission = Ask("wait");
  submission.deadline = SystemClock().Now() + 200ms;
  const JobId late = manager->Submit(submission)->job.id;
  submission.body = "1 1 1";
  submission.deadline = SystemClock().Now() + 100ms;
  const JobId unmeetable = manager->Submit(submission)->job.id;
  const Job job = Wait(*manager, late);
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_EQ(job.error.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_GE(*job.finished, *job.deadline);
  EXPECT_LE(*job.finished, *job.deadline + 2s);
  const Job other = Wait(*manager, unmeetable);
  EXPECT_EQ(other.state, JobState::kFailed);
  EXPECT_EQ(other.error.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(other.chunks, 0);
}

TEST_F(JobManagerTest, ADrainedServerLosesNothingAndItsSuccessorGoesOn) {
  auto manager = Start();
  const JobId longer = Submit(*manager, "40 5 2000");
  const JobId shorter = Submit(*manager, "2 1 1000");
  std::int64_t seen = 0;
  {
    JobFollower follower(*manager, longer);
    follower.Read([](const Event& event) { return *event.payload == "window 3"; });
    seen = follower.position();
  }
  manager->Drain(50ms);
  EXPECT_FALSE(manager->Healthy());
  EXPECT_EQ(manager->Submit(Ask("1 1 1")).status().code(), absl::StatusCode::kUnavailable);
  manager.reset();
  EXPECT_EQ(StateOf(shorter), JobState::kSucceeded);
  EXPECT_EQ(StateOf(longer), JobState::kQueued);
  const std::int64_t accepted = store_.Get("ada", longer)->chunks;
  EXPECT_GE(accepted, 4);
  EXPECT_LT(accepted, 40);

  manager = Start(Fast("another"));
  JobFollower follower(*manager, longer, {.after = seen});
  follower.Read();
  EXPECT_EQ(follower.durable.front(), "window 4");
  EXPECT_THAT(follower.durable, Contains("QUEUED"));
  EXPECT_EQ(follower.durable.back(), "solved");
  EXPECT_EQ(Trajectory(store_, longer), Trajectory(40));
  EXPECT_EQ(store_.Get("ada", longer)->attempts, 1);
}

TEST_F(JobManagerTest, TheGracePeriodLetsJobsEnd) {
  const auto manager = Start();
  const JobId id = Submit(*manager, "3 10 1000");
  JobFollower(*manager, id).Read([](const Event& event) { return event.kind == EventKind::kIterate; });
  manager->Drain(20s);
  EXPECT_EQ(StateOf(id), JobState::kSucceeded);
}

TEST_F(JobManagerTest, CoresWorkOnWhileJobsAreBroughtToTheirEnd) {
  std::mutex mutex;
  std::condition_variable changed;
  JobId held;  // the first job, as soon as its name is known; the second one may end before it
  bool may_end = false;
  store_.before_finish = [&](const Lease& lease) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return !held.empty() && (lease.job != held || may_end); });
  };
  const auto manager = Start(Fast("one", 1));
  const JobId first = Submit(*manager, "2 1 0");
  {
    const std::lock_guard lock(mutex);
    held = first;
  }
  changed.notify_all();
  const JobId second = Submit(*manager, "2 1 0");
  EXPECT_EQ(Wait(*manager, second).state, JobState::kSucceeded);
  EXPECT_EQ(StateOf(first), JobState::kRunning);
  {
    const std::lock_guard lock(mutex);
    may_end = true;
  }
  changed.notify_all();
  EXPECT_EQ(Wait(*manager, first).state, JobState::kSucceeded);
}

TEST_F(JobManagerTest, ASmallJobOfALightUserRunsBesideFullCores) {
  JobManagerOptions options = Fast("one", 1);
  options.limits.burst_cores = 1;
  const auto manager = Start(options);
  const JobId heavy = Submit(*manager, "wait");
  JobFollower(*manager, heavy).Read([](const Event& event) { return *event.payload == "RUNNING"; });
  const JobId next = Submit(*manager, "wait");
  Submission light = Ask("2 1 0");
  light.owner = "bob";
  const auto created = manager->Submit(light);
  ASSERT_TRUE(created.ok()) << created.status();
  JobFollower follower(*manager, created->job.id);
  follower.Read();
  EXPECT_EQ(follower.durable.back(), "solved");
  EXPECT_EQ(StateOf(heavy), JobState::kRunning);
  EXPECT_EQ(StateOf(next), JobState::kQueued);
}

TEST_F(JobManagerTest, WhatIsNotReadIsRefusedAsWhatIs) {
  JobManagerOptions options = Fast("one", 1);
  options.limits.max_queued_jobs = 1;
  const auto manager = Start(options);
  EXPECT_TRUE(manager->CheckQueueSpace("ada").ok());
  const JobId running = Submit(*manager, "wait");
  JobFollower(*manager, running).Read([](const Event& event) { return *event.payload == "RUNNING"; });
  Submit(*manager, "wait");
  EXPECT_EQ(RefusalOf(manager->CheckQueueSpace("ada"))->limit, "max_queued_jobs");
  EXPECT_EQ(RefusalOf(manager->Submit(Ask("nonsense")).status())->limit, "max_queued_jobs");
  manager->Drain(Duration(0));
  EXPECT_EQ(manager->CheckQueueSpace("ada").code(), absl::StatusCode::kUnavailable);
}

TEST_F(JobManagerTest, AStoreThatFailsForAWhileHoldsUpNothingButWhatWatchersSee) {
  const auto manager = Start();
  const JobId id = Submit(*manager, "30 5 1000");
  JobFollower follower(*manager, id);
  follower.Read([](const Event& event) { return *event.payload == "window 1"; });
  store_.broken = true;
  EXPECT_FALSE(manager->Healthy());
  EXPECT_EQ(manager->Submit(Ask("1 1 1")).status().code(), absl::StatusCode::kUnavailable);
  std::this_thread::sleep_for(100ms);
  store_.broken = false;
  follower.Read();
  EXPECT_EQ(follower.durable.size(), 2u + 1 + 30 + 2);
  EXPECT_EQ(Trajectory(store_, id), Trajectory(30));
  EXPECT_TRUE(manager->Healthy());
  EXPECT_EQ(Wait(*manager, Submit(*manager, "1 1 1")).state, JobState::kSucceeded);
}

TEST_F(JobManagerTest, AnAttemptThatCannotReadTheStoreIsNotTheLast) {
  const auto manager = Start();
  const JobId id = Submit(*manager, "unreachable");
  JobFollower follower(*manager, id);
  follower.Read();
  EXPECT_THAT(follower.durable, ElementsAre("QUEUED", "RUNNING", "SUCCEEDED", "solved"));
  EXPECT_EQ(StateOf(id), JobState::kSucceeded);
}

TEST_F(JobManagerTest, AnAttemptThatBreaksDownIsFollowedByAnother) {
  JobManagerOptions options = Fast();
  options.max_attempts = 3;
  const auto manager = Start(options);
  const JobId id = Submit(*manager, "break down twice");
  JobFollower follower(*manager, id);
  follower.Read();
  EXPECT_THAT(follower.durable,
              ElementsAre("QUEUED", "RUNNING", "QUEUED", "RUNNING", "QUEUED", "RUNNING", "SUCCEEDED", "solved"));
  EXPECT_EQ(store_.Get("ada", id)->attempts, 3);
  const Job unmeetable = Wait(*manager, Submit(*manager, "break down"));
  EXPECT_EQ(unmeetable.state, JobState::kFailed);
  EXPECT_EQ(unmeetable.error.code(), absl::StatusCode::kInternal);
  EXPECT_EQ(Wait(*manager, Submit(*manager, "1 1 1")).state, JobState::kSucceeded);
}

TEST_F(JobManagerTest, AnswersThatAreLostChangeNothing) {
  const auto manager = Start();
  const JobId id = Submit(*manager, "30 3 1000");
  std::atomic<bool> done = false;
  std::thread trouble([this, &done] {
    while (!done) {
      store_.answers_lost = !store_.answers_lost;
      std::this_thread::sleep_for(7ms);
    }
    store_.answers_lost = false;
  });
  JobFollower follower(*manager, id);
  follower.Read();
  done = true;
  trouble.join();
  EXPECT_EQ(follower.durable.size(), 2u + 1 + 30 + 2);
  EXPECT_EQ(Trajectory(store_, id), Trajectory(30));
}

TEST_F(JobManagerTest, TwoServersShareTheWorkAndTheWatchers) {
  const auto one = Start(Fast("one", 1));
  const auto two = Start(Fast("two", 1));
  std::vector<JobId> ids;
  for (int k = 0; k < 12; ++k) ids.push_back(Submit(k % 2 == 0 ? *one : *two, "4 5 1000"));
  for (const JobId& id : ids) {
    for (JobManager* manager : {one.get(), two.get()}) {
      JobFollower follower(*manager, id);
      follower.Read();
      EXPECT_EQ(follower.durable.size(), 9u);
    }
    EXPECT_EQ(Trajectory(store_, id), Trajectory(4));
    EXPECT_EQ(store_.Get("ada", id)->attempts, 1);
  }
}

TEST_F(JobManagerTest, AFrontAdmitsAndFollowsAndLetsOthersRun) {
  JobManagerOptions options = Fast("front", 1);
  options.runs_jobs = false;
  options.limits.max_queued_jobs = 2;
  const auto front = Start(options);
  const JobId first = Submit(*front, "3 5 1000");
  Submit(*front, "3 5 1000");
  EXPECT_EQ(RefusalOf(front->Submit(Ask("1 1 1")).status())->limit, "max_queued_jobs");
  EXPECT_EQ(front->load().queued, 2);
  const auto worker = Start(Fast("worker", 1));
  EXPECT_EQ(Wait(*front, first).state, JobState::kSucceeded);
  for (int k = 0; k < 500 && front->load().queued > 0; ++k) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(front->load().queued, 0);
  EXPECT_TRUE(front->Submit(Ask("1 1 1")).ok());
}

TEST_F(JobManagerTest, LeavesJobsThatItCannotRunToOthersUntilTheirDeadline) {
  JobManagerOptions options = Fast("one", 2);
  options.can_run = [](const std::string& about) { return about != "ranks"; };
  auto one = Start(options);
  Submission asked = Ask("3 5 1000");
  asked.about = "ranks";
  const JobId left = one->Submit(asked)->job.id;
  EXPECT_EQ(Wait(*one, Submit(*one, "3 5 1000")).state, JobState::kSucceeded);
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(StateOf(left), JobState::kQueued);
  EXPECT_EQ(one->load().queued, 1);
  EXPECT_GE(one->idle_for(), 100ms);  // it waits for nothing that it could do
  asked.deadline = SystemClock().Now() + 300ms;
  const Job late = Wait(*one, one->Submit(asked)->job.id);
  EXPECT_EQ(late.state, JobState::kFailed);
  EXPECT_EQ(late.error.code(), absl::StatusCode::kDeadlineExceeded);
  const auto two = Start(Fast("two", 1));
  EXPECT_EQ(Wait(*two, left).state, JobState::kSucceeded);
  EXPECT_EQ(store_.Get("ada", left)->attempts, 1);
}

TEST_F(JobManagerTest, IsIdleOnlyWhileThereIsNothingToRunOrToClaim) {
  const auto idle_for = [](const JobManager& manager, Duration wanted) {
    for (int k = 0; k < 500 && manager.idle_for() < wanted; ++k) std::this_thread::sleep_for(10ms);
    return manager.idle_for() >= wanted;
  };
  const auto manager = Start(Fast("one", 1));
  EXPECT_TRUE(idle_for(*manager, 100ms));
  const JobId first = Submit(*manager, "wait");
  const JobId second = Submit(*manager, "2 2 1000");  // waits for the core
  for (int k = 0; k < 500 && manager->load().running == 0; ++k) std::this_thread::sleep_for(10ms);
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(manager->idle_for(), Duration::zero());
  ASSERT_TRUE(manager->Cancel("ada", first).ok());
  EXPECT_EQ(Wait(*manager, second).state, JobState::kSucceeded);
  const auto ended = std::chrono::steady_clock::now();
  EXPECT_TRUE(idle_for(*manager, 200ms));
  EXPECT_GE(std::chrono::steady_clock::now() - ended, 100ms);  // since the end, not since the start
}

TEST_F(JobManagerTest, IsNotIdleWhileTheStoreDoesNotAnswer) {
  const auto manager = Start(Fast("one", 1));
  store_.cannot_list = true;
  std::this_thread::sleep_for(300ms);
  EXPECT_LT(manager->idle_for(), 200ms);
}

TEST_F(JobManagerTest, TellsWhatWaitsInTheStore) {
  JobManagerOptions options = Fast("front", 1);
  options.runs_jobs = false;
  const auto one = Start(options);
  options.worker = "other front";
  const auto other = Start(options);
  Submit(*one, "1 1 1");
  Submit(*one, "1 1 1");
  // What nobody has asked for is not known, rather than nothing.
  EXPECT_FALSE(other->load().is_measured);
  for (int k = 0; k < 500 && !other->load().is_measured; ++k) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(other->load().queued, 2);
  for (int k = 0; k < 500 && other->load().oldest_queued_age < 50ms; ++k) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(other->load().queued, 2);
  EXPECT_DOUBLE_EQ(other->load().queued_core_seconds, 0.02);
  EXPECT_GE(other->load().oldest_queued_age, 50ms);
  const auto worker = Start(Fast("worker", 1));
  for (int k = 0; k < 500 && other->load().queued > 0; ++k) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(other->load().queued, 0);
  EXPECT_EQ(other->load().oldest_queued_age, Duration::zero());
  store_.cannot_list = true;
  for (int k = 0; k < 500 && other->load().is_measured; ++k) std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(other->load().is_measured);
}

TEST_F(JobManagerTest, AServerThatWasTakenForDeadCannotSpoilTheResult) {
  JobManagerOptions options = Fast("cut off", 1);
  options.lease = 100ms;
  JobManager one(options, store_, &Cost, FakeSolve, SystemClock());
  const JobId id = Submit(one, "20 20 2000");
  JobFollower before(one, id);
  before.Read([](const Event& event) { return *event.payload == "window 2"; });
  store_.broken = true;  // for this server only: the other one has the file itself
  JobManager two(Fast("alive", 1), sqlite_, &Cost, FakeSolve, SystemClock());
  JobFollower after(two, id, {.after = before.position()});
  after.Read([](const Event& event) { return *event.payload == "window 10"; });
  store_.broken = false;
  after.Read();
  EXPECT_EQ(after.durable.back(), "solved");
  EXPECT_EQ(Trajectory(store_, id), Trajectory(20));
  // The watcher on the server that was cut off continues with the events of the other one.
  before.Read();
  EXPECT_EQ(before.durable.back(), "solved");
  EXPECT_EQ(std::count(before.durable.begin(), before.durable.end(), "window 10"), 1);
  EXPECT_EQ(std::count(before.durable.begin(), before.durable.end(), "window 19"), 1);
}

TEST_F(JobManagerTest, CancelReachesAJobThatRunsOnAnotherServer) {
  JobManagerOptions options = Fast("runs it", 1);
  options.lease = 200ms;  // renewed every 50 ms
  const auto runs = Start(options);
  const JobId id = Submit(*runs, "wait");
  JobFollower(*runs, id).Read([](const Event& event) { return event.kind == EventKind::kIterate; });
  const auto front = Start(Fast("front", 1));
  ASSERT_TRUE(front->Cancel("ada", id).ok());
  JobFollower follower(*front, id);
  follower.Read();
  EXPECT_EQ(StateOf(id), JobState::kCancelled);
}

TEST_F(JobManagerTest, GivesUpAJobThatEndsItsServers) {
  NewJob job;
  job.id = NewJobId();
  job.owner = "ada";
  job.body = "1 1 1";
  ASSERT_TRUE(store_.Create(job).ok());
  const JobId candidates[] = {job.id};
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE((*store_.Claim("one", 30s, candidates)).has_value());
    ASSERT_TRUE(store_.ReleaseLeases("one").ok());
  }
  JobManagerOptions options = Fast();
  options.max_attempts = 3;
  const auto manager = Start(options);
  EXPECT_EQ(Wait(*manager, job.id).state, JobState::kFailed);
  EXPECT_EQ(store_.Get("ada", job.id)->error.code(), absl::StatusCode::kInternal);
}

TEST_F(JobManagerTest, ExpiresFinishedJobs) {
  JobManagerOptions options = Fast();
  options.expire_every = 20ms;
  options.expiry = {.max_age = 300ms};
  const auto manager = Start(options);
  const JobId id = Submit(*manager, "1 1 1");
  for (int k = 0; k < 500 && store_.Get("ada", id).ok(); ++k) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(store_.Get("ada", id).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobManagerTest, AWatcherOfADeletedJobIsTold) {
  const auto manager = Start();
  const JobId id = Submit(*manager, "1 1 1");
  Wait(*manager, id);
  JobFollower follower(*manager, id);
  ASSERT_TRUE(manager->Delete("ada", id).ok());
  follower.Read();
  EXPECT_EQ(follower.error().code(), absl::StatusCode::kNotFound);
}

// Everything at once, for the thread sanitizer.
TEST_F(JobManagerTest, ManyUsersWatchersAndCancels) {
  const auto manager = Start();
  std::vector<std::thread> users;
  std::atomic<int> succeeded = 0;
  for (int user = 0; user < 4; ++user) {
    users.emplace_back([&, user] {
      for (int k = 0; k < 8; ++k) {
        Submission submission = Ask("3 5 200");
        submission.owner = "user " + std::to_string(user);
        const auto created = manager->Submit(submission);
        ASSERT_TRUE(created.ok()) << created.status();
        JobFollower follower(*manager, created->job.id, {.min_interval = k % 2 == 0 ? 0ms : 5ms});
        if (k % 4 == 3) {
          EXPECT_TRUE(manager->Cancel(submission.owner, created->job.id).ok());
        }
        follower.Read();
        EXPECT_TRUE(follower.ended);
        const JobState state = store_.Get(submission.owner, created->job.id)->state;
        EXPECT_TRUE(IsFinal(state));
        succeeded += state == JobState::kSucceeded;
      }
    });
  }
  for (std::thread& user : users) user.join();
  EXPECT_GE(succeeded, 4 * 6);
}

}  // namespace
}  // namespace dlcs::jobs
