// SPDX-License-Identifier: Apache-2.0
// Ensembles run by one or several managers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/job_manager.h"
#include "server/store/sqlite/sqlite_job_store.h"
#include "tests/server/jobs/job_follower.h"
#include "tests/server/store/failing_store.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using testing::JobFollower;
using ::testing::UnorderedElementsAreArray;

// The body says what each shard does: nothing, "wait" until it is stopped, or "fail".
JobEnd SolveShard(JobRun& run) {
  const std::string shard = std::to_string(*run.lease().shard);
  while (run.body() == "wait") {
    if (run.stop().stop_requested()) return {absl::CancelledError(), ""};
    std::this_thread::sleep_for(500us);
  }
  if (run.body() == "fail") return {absl::InvalidArgumentError("no such member"), ""};
  std::this_thread::sleep_for(2ms);
  ShardResult result{.begin = 0, .end = 0, .data = *run.shard_input() + " solved", .count = [shard](const Job& before) {
                       return ShardResult::Count{.tally = before.tally + "+", .event = "shard " + shard};
                     }};
  return {absl::OkStatus(), "", std::move(result)};
}

class EnsembleManagerTest : public ::testing::Test {
 protected:
  static JobManagerOptions Fast(const std::string& worker) {
    JobManagerOptions options;
    options.limits.cores = 2;
    options.worker = worker;
    options.poll = 20ms;
    options.lease = 10s;
    options.max_attempts = 3;
    return options;
  }
  std::unique_ptr<JobManager> Start(const std::string& worker) { return Start(worker, store_); }
  static std::unique_ptr<JobManager> Start(const std::string& worker, JobStore& store) {
    const auto no_cost = [](const Submission&) -> absl::StatusOr<Demand> { return absl::InternalError("not asked"); };
    return std::make_unique<JobManager>(Fast(worker), store, no_cost, SolveShard, SystemClock());
  }
  static JobId Submit(JobManager& manager, int shards, const std::string& body = "",
                      std::optional<Time> deadline = std::nullopt, double core_seconds = 0.01) {
    Submission asked;
    asked.owner = "ada";
    asked.body = body;
    asked.deadline = deadline;
    asked.demand = Demand{.core_seconds = core_seconds, .memory_bytes = 1000, .threads = 1};
    for (int k = 0; k < shards; ++k) asked.shards.push_back("shard " + std::to_string(k));
    const auto created = manager.Submit(asked);
    EXPECT_TRUE(created.ok()) << created.status();
    return created->job.id;
  }
  // The stored results, in their order.
  std::vector<std::string> Results(const JobId& id) {
    std::vector<std::string> results;
    const auto chunks = store_.ReadChunks(id, 0, 1 << 30);
    EXPECT_TRUE(chunks.ok()) << chunks.status();
    for (const Chunk& chunk : *chunks) results.push_back(chunk.data);
    return results;
  }
  static std::vector<std::string> AllSolved(int shards) {
    std::vector<std::string> results;
    for (int k = 0; k < shards; ++k) results.push_back("shard " + std::to_string(k) + " solved");
    return results;
  }
  // Waits until a shard is being solved.
  void WaitForStart(const JobId& id) {
    for (int k = 0; k < 5000 && !store_.Get("ada", id)->started.has_value(); ++k) std::this_thread::sleep_for(1ms);
  }

  void ExpectEndAtDeadline(const JobId& id) {
    const auto job = store_.Get("ada", id);
    EXPECT_EQ(job->state, JobState::kFailed);
    EXPECT_EQ(job->error.code(), absl::StatusCode::kDeadlineExceeded);
    EXPECT_GE(*job->finished, *job->deadline);
    EXPECT_LE(*job->finished, *job->deadline + 2s);
  }

  testing::TemporaryFolder folder_;
  SqliteJobStore store_{{.path = folder_.File("jobs.db")}, SystemClock()};
};

TEST_F(EnsembleManagerTest, ManagersShareTheShards) {
  constexpr int kShards = 30;
  const auto one = Start("one"), two = Start("two");
  const JobId id = Submit(*one, kShards);
  JobFollower here(*one, id), there(*two, id);
  here.Read();
  there.Read();
  EXPECT_THAT(Results(id), UnorderedElementsAreArray(AllSolved(kShards)));
  EXPECT_EQ(store_.Get("ada", id)->tally, std::string(kShards, '+'));
  EXPECT_EQ(here.durable.size(), static_cast<std::size_t>(kShards) + 3);
  EXPECT_EQ(here.durable.front(), "RUNNING");
  EXPECT_EQ(here.durable[kShards + 1], "SUCCEEDED");
  EXPECT_EQ(there.durable, here.durable);
}

TEST_F(EnsembleManagerTest, ACancelledEnsembleStopsEverywhere) {
  const auto one = Start("one"), two = Start("two");
  const JobId id = Submit(*one, 5, "wait");
  WaitForStart(id);
  EXPECT_EQ(two->Cancel("ada", id)->state, JobState::kCancelled);
  JobFollower follower(*one, id);
  follower.Read();
  EXPECT_EQ(follower.durable, (std::vector<std::string>{"RUNNING", "CANCELLED", ""}));
  // Another job gets the cores, since no shard is waiting for them.
  const JobId next = Submit(*one, 2);
  JobFollower(*one, next).Read();
  EXPECT_EQ(store_.Get("ada", next)->state, JobState::kSucceeded);
}

TEST_F(EnsembleManagerTest, AShardThatFailsEndsTheEnsemble) {
  const auto one = Start("one");
  const JobId id = Submit(*one, 5, "fail");
  JobFollower follower(*one, id);
  follower.Read();
  EXPECT_EQ(follower.durable, (std::vector<std::string>{"RUNNING", "FAILED", ""}));
  EXPECT_EQ(store_.Get("ada", id)->error, absl::InvalidArgumentError("no such member"));
}

TEST_F(EnsembleManagerTest, ADrainedManagerGivesItsShardBack) {
  auto one = Start("one");
  const JobId id = Submit(*one, 2, "wait");
  WaitForStart(id);
  one->Drain(0ms);
  one.reset();
  const JobId candidates[] = {id};
  const auto claimed = store_.Claim("two", 10s, candidates);
  ASSERT_TRUE(claimed->has_value());
  EXPECT_EQ((*claimed)->lease.shard, 0);
  EXPECT_EQ((*claimed)->job.attempts, 1);
}

TEST_F(EnsembleManagerTest, AShardThatKillsItsServersIsGivenUp) {
  const JobId id = [&] {
    const auto one = Start("one");
    one->Drain(0ms);
    NewJob job = testing::SampleJob("ada", "wait");
    job.shards = {"shard 0"};
    job.demand = {.core_seconds = 0.01, .memory_bytes = 1000, .threads = 1};
    return store_.Create(job)->job.id;
  }();
  for (int k = 0; k < 3; ++k) {
    const JobId candidates[] = {id};
    ASSERT_TRUE((*store_.Claim("two", 10s, candidates)).has_value());
    ASSERT_EQ(*store_.ReleaseLeases("two"), 1);  // as after kill -9 and a restart
  }
  const auto two = Start("two");
  JobFollower follower(*two, id);
  follower.Read();
  EXPECT_EQ(store_.Get("ada", id)->state, JobState::kFailed);
  EXPECT_EQ(store_.Get("ada", id)->error.code(), absl::StatusCode::kInternal);
}

TEST_F(EnsembleManagerTest, LostAnswersOfTheStoreLoseNothingAndRepeatNothing) {
  constexpr int kShards = 60;
  testing::FailingStore lossy(store_);
  const auto one = Start("one", lossy), two = Start("two", lossy);
  const JobId id = Submit(*one, kShards);
  for (int k = 0; k < 40; ++k) {
    lossy.answers_lost = k % 2 == 0;
    std::this_thread::sleep_for(5ms);
  }
  lossy.answers_lost = false;
  JobFollower follower(*one, id);
  follower.Read();
  EXPECT_THAT(Results(id), UnorderedElementsAreArray(AllSolved(kShards)));
  EXPECT_EQ(store_.Get("ada", id)->tally, std::string(kShards, '+'));
}

TEST_F(EnsembleManagerTest, ADeadlineEndsTheEnsemble) {
  const auto one = Start("one");
  const JobId id = Submit(*one, 2, "wait", SystemClock().Now() + 300ms);
  JobFollower follower(*one, id);
  follower.Read();
  ExpectEndAtDeadline(id);
}

TEST_F(EnsembleManagerTest, ADeadlineEndsAnEnsembleThatIsQueuedAndNotBefore) {
  const auto one = Start("one");
  for (const JobId& busy : {Submit(*one, 1, "wait"), Submit(*one, 1, "wait")}) WaitForStart(busy);
  const JobId id = Submit(*one, 2, "", SystemClock().Now() + 300ms, 0.29);
  JobFollower follower(*one, id);
  follower.Read();
  ExpectEndAtDeadline(id);
}

// No server runs it, so the manager that does not run jobs must notice the deadline.
TEST_F(EnsembleManagerTest, ADeadlineEndsAnEnsembleThatOnlyAFrontKnows) {
  JobManagerOptions options = Fast("front");
  options.runs_jobs = false;
  const auto no_cost = [](const Submission&) -> absl::StatusOr<Demand> { return absl::InternalError("not asked"); };
  JobManager front(options, store_, no_cost, SolveShard, SystemClock());
  const JobId id = Submit(front, 2, "", SystemClock().Now() + 300ms);
  JobFollower follower(front, id);
  follower.Read();
  ExpectEndAtDeadline(id);
}

}  // namespace
}  // namespace dlcs::jobs
