// SPDX-License-Identifier: Apache-2.0
// Ensembles in the store: leases on shards, results that are stored once.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/store/job_samples.h"
#include "tests/server/store/job_store_contract.h"

namespace dlcs::jobs::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

NewJob SampleEnsemble(int shards, const std::string& owner = "ada") {
  NewJob job = SampleJob(owner, "the problem");
  for (int k = 0; k < shards; ++k) job.shards.push_back("members " + std::to_string(k) + std::string("\0\xff", 2));
  return job;
}

JobId SubmitEnsemble(JobStore& store, int shards) {
  const auto created = store.Create(SampleEnsemble(shards));
  EXPECT_TRUE(created.ok()) << created.status();
  return created->job.id;
}

std::optional<ClaimedJob> TryShard(JobStore& store, const JobId& id, const std::string& worker = "one",
                                   Duration lease = 30s) {
  const JobId candidates[] = {id};
  auto claimed = store.Claim(worker, lease, candidates);
  EXPECT_TRUE(claimed.ok()) << claimed.status();
  return *std::move(claimed);
}

ClaimedJob ClaimShard(JobStore& store, const JobId& id, const std::string& worker = "one", Duration lease = 30s) {
  auto claimed = TryShard(store, id, worker, lease);
  EXPECT_TRUE(claimed.has_value());
  return *std::move(claimed);
}

// A result that counts itself: the tally is the number of shards.
ShardResult ResultOf(const ClaimedJob& claimed) {
  const std::string shard = std::to_string(*claimed.lease.shard);
  return {.begin = 10.0 * static_cast<double>(*claimed.lease.shard),
          .end = 10.0 * static_cast<double>(*claimed.lease.shard) + 10,
          .data = "result of " + shard + std::string("\0\xff", 2),
          .count = [shard](const Job& before) {
            const int shards = before.tally.empty() ? 0 : std::stoi(before.tally);
            return ShardResult::Count{.tally = std::to_string(shards + 1), .event = "shard " + shard};
          }};
}

std::vector<std::string> TextsOfEvents(JobStore& store, const JobId& id) {
  std::vector<std::string> texts;
  const auto events = store.ReadEvents(id, 0, 1000);
  EXPECT_TRUE(events.ok()) << events.status();
  for (const Event& event : *events) texts.push_back(std::to_string(event.sequence) + " " + *event.payload);
  return texts;
}

bool IsOpen(JobStore& store, const JobId& id) {
  const auto jobs = store.ListClaimable(1000);
  EXPECT_TRUE(jobs.ok()) << jobs.status();
  return std::ranges::any_of(*jobs, [&id](const Job& job) { return job.id == id; });
}

bool IsLost(const absl::Status& status) { return status.code() == absl::StatusCode::kAborted; }

TEST_P(JobStoreContractTest, SeveralWorkersSolveShardsOfOneEnsemble) {
  const JobId id = SubmitEnsemble(store_, 3);
  JobStore& other = shared_->other();
  EXPECT_EQ(other.Get("ada", id)->shards, 3);
  EXPECT_EQ(other.Get("ada", id)->state, JobState::kRunning);
  EXPECT_FALSE(other.Get("ada", id)->started.has_value());
  const ClaimedJob first = ClaimShard(store_, id, "one");
  const ClaimedJob second = ClaimShard(other, id, "other");
  EXPECT_EQ(first.lease.shard, 0);
  EXPECT_EQ(second.lease.shard, 1);
  EXPECT_EQ(first.body, "the problem");
  EXPECT_EQ(second.shard_input, "members 1" + std::string("\0\xff", 2));
  EXPECT_EQ(second.job.attempts, 1);
  EXPECT_TRUE(store_.Get("ada", id)->started.has_value());
  EXPECT_TRUE(IsOpen(store_, id));
  const ClaimedJob third = ClaimShard(store_, id, "third");
  EXPECT_FALSE(IsOpen(store_, id));
  EXPECT_FALSE(TryShard(store_, id).has_value());

  ASSERT_TRUE(other.FinishShard(second.lease, ResultOf(second)).ok());
  EXPECT_DOUBLE_EQ(store_.Get("ada", id)->progress, 1.0 / 3);
  EXPECT_EQ(store_.Get("ada", id)->tally, "1");
  ASSERT_TRUE(store_.FinishShard(third.lease, ResultOf(third)).ok());
  ASSERT_TRUE(store_.FinishShard(first.lease, ResultOf(first)).ok());

  const auto done = other.Get("ada", id);
  EXPECT_EQ(done->state, JobState::kSucceeded);
  EXPECT_EQ(done->progress, 1);
  EXPECT_EQ(done->tally, "3");
  EXPECT_TRUE(done->finished.has_value());
  EXPECT_THAT(TextsOfEvents(store_, id),
              ElementsAre("1 RUNNING", "2 shard 1", "3 shard 2", "4 shard 0", "5 SUCCEEDED", "6 "));
  // In the order in which they were stored.
  const auto chunks = store_.ReadChunks(id, 0, 1'000'000);
  ASSERT_EQ(chunks->size(), 3u);
  EXPECT_EQ(chunks->at(0).data, ResultOf(second).data);
  EXPECT_EQ(chunks->at(0).begin, 10);
  EXPECT_EQ(chunks->at(2).data, ResultOf(first).data);
  ASSERT_TRUE(store_.Delete("ada", id).ok());
}

TEST_P(JobStoreContractTest, AShardIsStoredOnceHoweverOftenItWasSolved) {
  const JobId id = SubmitEnsemble(store_, 1);
  const ClaimedJob first = ClaimShard(store_, id, "one", 30s);
  shared_->Advance(31s);
  EXPECT_TRUE(IsOpen(store_, id));
  const ClaimedJob second = ClaimShard(shared_->other(), id, "other", 30s);
  EXPECT_EQ(second.lease.shard, 0);
  EXPECT_EQ(second.job.attempts, 2);
  // The first was taken for dead.
  EXPECT_TRUE(IsLost(store_.RenewLease(first.lease, 30s).status()));
  EXPECT_TRUE(IsLost(store_.FinishShard(first.lease, ResultOf(first))));
  EXPECT_TRUE(IsLost(store_.Release(first.lease, 0, false)));
  EXPECT_TRUE(IsLost(store_.Finish(first.lease, SampleEnd(9, JobState::kFailed))));
  EXPECT_TRUE(store_.RenewLease(second.lease, 30s).ok());
  ASSERT_TRUE(store_.FinishShard(second.lease, ResultOf(second)).ok());
  // If the response was lost, repeating the call changes nothing.
  EXPECT_TRUE(IsLost(store_.FinishShard(second.lease, ResultOf(second))));
  EXPECT_EQ(store_.ReadChunks(id, 0, 1'000'000)->size(), 1u);
  EXPECT_THAT(TextsOfEvents(store_, id), ElementsAre("1 RUNNING", "2 shard 0", "3 SUCCEEDED", "4 "));
}

TEST_P(JobStoreContractTest, ALeaseOnAShardIsRenewedReleasedAndTakenBackAfterARestart) {
  const JobId id = SubmitEnsemble(store_, 2);
  const ClaimedJob first = ClaimShard(store_, id, "one", 30s);
  ClaimShard(store_, id, "two", 3600s);
  shared_->Advance(20s);
  EXPECT_FALSE(*store_.RenewLease(first.lease, 30s));
  shared_->Advance(20s);
  EXPECT_FALSE(IsOpen(store_, id));
  ASSERT_TRUE(store_.Release(first.lease, 0, false).ok());
  EXPECT_TRUE(IsOpen(store_, id));
  const ClaimedJob again = ClaimShard(store_, id, "one");
  EXPECT_EQ(again.lease.shard, 0);
  EXPECT_EQ(again.job.attempts, 1);  // a release does not count as a crash
  EXPECT_EQ(*store_.ReleaseLeases("two"), 1);
  const ClaimedJob restarted = ClaimShard(store_, id, "two");
  EXPECT_EQ(restarted.lease.shard, 1);
  EXPECT_EQ(restarted.job.attempts, 2);
  EXPECT_THAT(TextsOfEvents(store_, id), ElementsAre("1 RUNNING"));
}

TEST_P(JobStoreContractTest, ACancelledEnsembleEndsAtOnceAndKeepsWhatItHas) {
  const JobId id = SubmitEnsemble(store_, 3);
  const ClaimedJob first = ClaimShard(store_, id);
  const ClaimedJob second = ClaimShard(store_, id);
  ASSERT_TRUE(store_.FinishShard(first.lease, ResultOf(first)).ok());
  EXPECT_EQ(shared_->other().RequestCancel("ada", id)->state, JobState::kCancelled);
  EXPECT_TRUE(IsLost(store_.RenewLease(second.lease, 30s).status()));
  EXPECT_TRUE(IsLost(store_.FinishShard(second.lease, ResultOf(second))));
  EXPECT_FALSE(TryShard(store_, id).has_value());
  EXPECT_FALSE(IsOpen(store_, id));
  EXPECT_EQ(store_.ReadChunks(id, 0, 1'000'000)->size(), 1u);
  EXPECT_THAT(TextsOfEvents(store_, id), ElementsAre("1 RUNNING", "2 shard 0", "3 CANCELLED", "4 "));
  EXPECT_EQ(store_.MeasureQueue()->jobs, 0);
}

TEST_P(JobStoreContractTest, AShardThatCannotBeSolvedFailsItsEnsemble) {
  const JobId id = SubmitEnsemble(store_, 2);
  const ClaimedJob first = ClaimShard(store_, id);
  const ClaimedJob second = ClaimShard(store_, id);
  ASSERT_TRUE(store_.Finish(second.lease, SampleEnd(0, JobState::kFailed)).ok());
  EXPECT_EQ(store_.Get("ada", id)->state, JobState::kFailed);
  EXPECT_EQ(store_.Get("ada", id)->error.message(), "it broke");
  EXPECT_TRUE(IsLost(store_.FinishShard(first.lease, ResultOf(first))));
  EXPECT_FALSE(TryShard(store_, id).has_value());
}

TEST_P(JobStoreContractTest, EachShardCountsInTheQueue) {
  const JobId id = SubmitEnsemble(store_, 4);
  EXPECT_EQ(store_.MeasureQueue()->jobs, 4);
  EXPECT_EQ(store_.MeasureQueue()->core_seconds, 10);
  const ClaimedJob first = ClaimShard(store_, id);
  EXPECT_EQ(store_.MeasureQueue()->jobs, 3);
  ASSERT_TRUE(store_.FinishShard(first.lease, ResultOf(first)).ok());
  EXPECT_EQ(store_.MeasureQueue()->jobs, 3);
}

TEST_P(JobStoreContractTest, ManyWorkersStoreEveryShardOnce) {
  constexpr int kShards = 40;
  const JobId id = SubmitEnsemble(store_, kShards);
  std::vector<std::thread> workers;
  for (int k = 0; k < 4; ++k) {
    workers.emplace_back([&, k] {
      JobStore& store = k % 2 == 0 ? store_ : shared_->other();
      while (const auto claimed = TryShard(store, id, "worker " + std::to_string(k))) {
        EXPECT_TRUE(store.FinishShard(claimed->lease, ResultOf(*claimed)).ok());
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  EXPECT_EQ(store_.Get("ada", id)->state, JobState::kSucceeded);
  EXPECT_EQ(store_.Get("ada", id)->tally, std::to_string(kShards));
  std::vector<double> begins;
  const auto chunks = store_.ReadChunks(id, 0, 1'000'000);
  for (const Chunk& chunk : *chunks) begins.push_back(chunk.begin);
  std::ranges::sort(begins);
  ASSERT_EQ(begins.size(), static_cast<std::size_t>(kShards));
  for (int k = 0; k < kShards; ++k) EXPECT_EQ(begins[static_cast<std::size_t>(k)], 10 * k);
}

}  // namespace
}  // namespace dlcs::jobs::testing
