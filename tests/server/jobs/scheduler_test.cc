// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/scheduler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "tests/server/store/manual_clock.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class SchedulerTest : public ::testing::Test {
 protected:
  static Scheduler::Request Job(const std::string& owner, const std::string& name, double core_seconds = 1) {
    return {.id = owner + name,
            .owner = owner,
            .priority = 0,
            .demand = {.core_seconds = core_seconds, .memory_bytes = 1, .threads = 1},
            .deadline = std::nullopt};
  }
  // Starts the queued jobs in order, and ends each at once.
  static std::vector<JobId> Order(Scheduler& scheduler) {
    std::vector<JobId> order;
    while (const auto start = scheduler.StartNext()) {
      order.push_back(start->id);
      scheduler.Finished(start->id, scheduler.running() > 0 ? 1 : 0);
    }
    return order;
  }

  testing::ManualClock clock_;
};

TEST_F(SchedulerTest, TakesTurnsBetweenUsersAndKeepsTheOrderOfEach) {
  Scheduler scheduler({.cores = 1}, clock_);
  for (const std::string k : {"1", "2", "3"}) EXPECT_FALSE(scheduler.Enqueue(Job("ada", k)).has_value());
  for (const std::string k : {"1", "2"}) EXPECT_FALSE(scheduler.Enqueue(Job("bob", k)).has_value());
  EXPECT_THAT(Order(scheduler), ElementsAre("ada1", "bob1", "ada2", "bob2", "ada3"));
  EXPECT_EQ(scheduler.queued(), 0);
  EXPECT_EQ(scheduler.queued_core_seconds(), 0);
}

TEST_F(SchedulerTest, CoreSecondsCountNotJobs) {
  Scheduler scheduler({.cores = 1}, clock_);
  scheduler.Restore(Job("big", "1", 10));
  scheduler.Restore(Job("big", "2", 10));
  for (int k = 0; k < 20; ++k) scheduler.Restore(Job("small", std::to_string(k), 1));
  double small = 0;
  double big = 0;
  while (const auto start = scheduler.StartNext()) {
    const bool is_big = start->id.starts_with("big");
    (is_big ? big : small) += is_big ? 10 : 1;
    scheduler.Finished(start->id, is_big ? 10 : 1);
    EXPECT_LE(std::abs(big - small), 11);  // within one job of each
  }
  EXPECT_EQ(big, 20);
  EXPECT_EQ(small, 20);
}

TEST_F(SchedulerTest, AShardTakesTheCoresThatAreFree) {
  Scheduler scheduler({.cores = 4}, clock_);
  Scheduler::Request shard = Job("bob", "ensemble");
  shard.demand.threads = 100;
  shard.takes_free_cores = true;
  scheduler.Restore(Job("ada", "solve"));
  ASSERT_EQ(scheduler.StartNext()->id, "adasolve");
  scheduler.Restore(shard);
  EXPECT_EQ(scheduler.StartNext()->threads, 3);
  EXPECT_FALSE(scheduler.has_free_cores());
  scheduler.Finished("bobensemble", 1);
  scheduler.Finished("adasolve", 1);
  scheduler.Restore(shard);
  EXPECT_EQ(scheduler.StartNext()->threads, 4);
  scheduler.Restore(Job("ada", "next"));
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Finished("bobensemble", 1);
  EXPECT_EQ(scheduler.StartNext()->threads, 1);
}

TEST_F(SchedulerTest, PredictingTooLittleGainsNothing) {
  Scheduler scheduler({.cores = 1, .max_queued_jobs_per_user = 1000}, clock_);
  for (int k = 0; k < 300; ++k) {
    scheduler.Restore(Job("honest", std::to_string(k), 1));
    scheduler.Restore(Job("liar", std::to_string(k), 0.1));
  }
  double honest = 0;
  double liar = 0;
  for (int k = 0; k < 200; ++k) {
    const auto start = scheduler.StartNext();
    ASSERT_TRUE(start.has_value());
    (start->id.starts_with("liar") ? liar : honest) += 1;
    scheduler.Finished(start->id, 1);  // all have the same cost
  }
  EXPECT_NEAR(liar, honest, 4);
}

TEST_F(SchedulerTest, WhatIsForOthersHasItsPlaceAndIsNeverStarted) {
  Scheduler scheduler({.cores = 2, .max_queued_jobs = 3}, clock_);
  Scheduler::Request other = Job("ada", "ranks", 10);
  other.is_for_others = true;
  other.deadline = clock_.Now() + 20s;
  scheduler.Restore(other);
  EXPECT_FALSE(scheduler.StartNext().has_value());
  EXPECT_EQ(scheduler.queued(), 1);
  EXPECT_EQ(scheduler.queued_core_seconds(), 10);
  for (const std::string k : {"1", "2"}) scheduler.Restore(Job("ada", k));
  EXPECT_EQ(scheduler.Refuse(Job("bob", "1"))->limit, "max_queued_jobs");
  ASSERT_EQ(scheduler.StartNext()->id, "ada1");
  EXPECT_THAT(scheduler.SetAside("ada1", 100), ElementsAre("ada2"));
  scheduler.PutBack("ada1");
  EXPECT_EQ(scheduler.StartNext()->id, "ada2");
  EXPECT_FALSE(scheduler.StartNext().has_value());
  for (const std::string k : {"ada1", "ada2"}) scheduler.Finished(k, 1);
  EXPECT_FALSE(scheduler.StartNext().has_value());
  EXPECT_THAT(scheduler.QueuedIds(), ElementsAre("adaranks"));
  clock_.Advance(11s);
  EXPECT_THAT(scheduler.TakeUnmeetable(), ElementsAre("adaranks"));
  EXPECT_EQ(scheduler.queued(), 0);
}

// SetAside() returns the next jobs, in the order in which they would start without the first one; nothing else starts
// them meanwhile.
TEST_F(SchedulerTest, AnotherJobTakesThePlaceOfOneThatAnotherServerHas) {
  Scheduler scheduler({.cores = 2}, clock_);
  for (const std::string k : {"1", "2", "3", "4", "5"}) scheduler.Restore(Job("ada", k));
  for (const std::string k : {"1", "2", "3"}) scheduler.Restore(Job("bob", k));
  ASSERT_EQ(scheduler.StartNext()->id, "ada1");
  EXPECT_THAT(scheduler.SetAside("ada1", 100), ElementsAre("ada2", "bob1", "ada3"));  // half of the queue
  ASSERT_EQ(scheduler.StartNext()->id, "bob2");
  EXPECT_THAT(scheduler.SetAside("bob2", 1), ElementsAre("bob3"));
  EXPECT_FALSE(scheduler.StartNext().has_value()) << "both cores are taken";
  EXPECT_EQ(scheduler.Settle("ada1", Job("bob", "1"))->id, "bob1");
  EXPECT_FALSE(scheduler.Knows("ada1"));
  EXPECT_FALSE(scheduler.Knows("ada2"));
  EXPECT_TRUE(scheduler.Knows("ada3"));
  EXPECT_FALSE(scheduler.Settle("bob2", std::nullopt).has_value());
  EXPECT_TRUE(scheduler.Knows("bob2"));
  scheduler.Finished("bob2", 0);
  EXPECT_FALSE(scheduler.Knows("bob3"));
  EXPECT_EQ(scheduler.running(), 1);
  scheduler.Finished("bob1", 1);
  EXPECT_THAT(Order(scheduler), ElementsAre("ada3", "ada4", "ada5"));
  EXPECT_EQ(scheduler.queued_core_seconds(), 0);
}

TEST_F(SchedulerTest, WhatWasSetAsideIsQueuedAgainInItsOrder) {
  Scheduler scheduler({.cores = 1}, clock_);
  for (const std::string k : {"1", "2", "3", "4", "5", "6", "7"}) scheduler.Restore(Job("ada", k));
  ASSERT_EQ(scheduler.StartNext()->id, "ada1");
  EXPECT_THAT(scheduler.SetAside("ada1", 2), ElementsAre("ada2", "ada3"));
  scheduler.PutBack("ada1");
  EXPECT_THAT(scheduler.SetAside("ada1", 100), ElementsAre("ada2", "ada3", "ada4"));
  EXPECT_TRUE(scheduler.Remove("ada3"));
  EXPECT_EQ(scheduler.Settle("ada1", Job("ada", "1"))->id, "ada1");
  scheduler.Finished("ada1", 1);
  EXPECT_THAT(Order(scheduler), ElementsAre("ada2", "ada4", "ada5", "ada6", "ada7"));
}

// Removed from the queue while it is being claimed, as a job that would miss its deadline is.
TEST_F(SchedulerTest, AJobThatIsNotQueuedTakesThePlaceToo) {
  Scheduler scheduler({.cores = 1}, clock_);
  for (const std::string k : {"1", "2", "3"}) scheduler.Restore(Job("ada", k));
  ASSERT_EQ(scheduler.StartNext()->id, "ada1");
  ASSERT_THAT(scheduler.SetAside("ada1", 100), ElementsAre("ada2"));
  ASSERT_TRUE(scheduler.Remove("ada2"));
  EXPECT_EQ(scheduler.Settle("ada1", Job("ada", "2"))->id, "ada2");
  scheduler.Finished("ada2", 1);
  EXPECT_THAT(Order(scheduler), ElementsAre("ada3"));
}

TEST_F(SchedulerTest, OnlyWhatFitsIntoAPlaceTakesIt) {
  Scheduler scheduler({.cores = 4, .max_running_memory_bytes = 100, .large_core_seconds = 30}, clock_);
  const auto add = [&](const std::string& name, int threads, std::int64_t memory, double core_seconds = 1) {
    Scheduler::Request request = Job("ada", name, core_seconds);
    request.demand.threads = threads;
    request.demand.memory_bytes = memory;
    request.takes_free_cores = name == "ensemble";
    scheduler.Restore(request);
  };
  add("other", 1, 50);
  add("1", 2, 40);
  add("threads", 3, 10);
  add("memory", 1, 60);
  add("large", 1, 10, 31);
  add("ensemble", 1, 10);
  add("fits", 2, 50);
  for (int k = 0; k < 6; ++k) add("threads" + std::to_string(k), 4, 10);
  ASSERT_EQ(scheduler.StartNext()->id, "adaother");
  ASSERT_EQ(scheduler.StartNext()->id, "ada1");
  EXPECT_THAT(scheduler.SetAside("ada1", 100), ElementsAre("adafits"));
}

TEST_F(SchedulerTest, PriorityCountsWithinAUserOnly) {
  Scheduler scheduler({.cores = 1}, clock_);
  Scheduler::Request urgent = Job("ada", "urgent");
  urgent.priority = 5;
  scheduler.Restore(Job("ada", "1"));
  scheduler.Restore(Job("ada", "2"));
  scheduler.Restore(Job("bob", "1"));
  scheduler.Restore(urgent);
  EXPECT_THAT(Order(scheduler), ElementsAre("adaurgent", "bob1", "ada1", "ada2"));
}

TEST_F(SchedulerTest, RunsWhatFitsIntoCoresAndMemory) {
  Scheduler scheduler({.cores = 3, .max_running_memory_bytes = 100}, clock_);
  const auto add = [&](const std::string& name, int threads, std::int64_t memory) {
    Scheduler::Request request = Job("ada", name);
    request.demand.threads = threads;
    request.demand.memory_bytes = memory;
    scheduler.Restore(request);
  };
  add("a", 2, 60);
  add("b", 2, 10);  // no core for it beside a
  add("c", 1, 50);  // no memory
  add("d", 1, 40);
  EXPECT_EQ(scheduler.StartNext()->id, "adaa");
  EXPECT_EQ(scheduler.StartNext()->id, "adad");
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Finished("adaa", 1);
  EXPECT_EQ(scheduler.StartNext()->id, "adab");
  scheduler.Finished("adad", 1);
  EXPECT_EQ(scheduler.StartNext()->id, "adac");
  EXPECT_EQ(scheduler.running(), 2);
}

TEST_F(SchedulerTest, CapsTheThreadsOfAJob) {
  Scheduler scheduler({.cores = 8, .max_threads_per_job = 4, .large_core_seconds = 10, .cores_kept_for_small = 6},
                      clock_);
  Scheduler::Request wide = Job("ada", "wide");
  wide.demand.threads = 64;
  Scheduler::Request large = Job("ada", "large", 100);
  large.demand.threads = 64;
  scheduler.Restore(wide);
  scheduler.Restore(large);
  EXPECT_EQ(scheduler.StartNext()->threads, 4);
  EXPECT_EQ(scheduler.StartNext()->threads, 2);
}

TEST_F(SchedulerTest, ALargeJobLeavesACoreToSmallOnes) {
  Scheduler scheduler({.cores = 2, .large_core_seconds = 10, .cores_kept_for_small = 1}, clock_);
  scheduler.Restore(Job("ada", "large1", 1000));
  scheduler.Restore(Job("ada", "large2", 1000));
  EXPECT_EQ(scheduler.StartNext()->id, "adalarge1");
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Restore(Job("bob", "small", 0.1));
  EXPECT_EQ(scheduler.StartNext()->id, "bobsmall");
}

TEST_F(SchedulerTest, ASmallJobOfWhoHasSavedForItDoesNotWaitForJobsThatRun) {
  Scheduler scheduler({.cores = 2, .small_core_seconds = 1, .burst_cores = 1}, clock_);
  for (int k = 0; k < 10; ++k) scheduler.Restore(Job("heavy", std::to_string(k), 0.5));
  EXPECT_EQ(scheduler.StartNext()->id, "heavy0");
  EXPECT_EQ(scheduler.StartNext()->id, "heavy1");
  EXPECT_FALSE(scheduler.StartNext().has_value());  // small as well, but its user has used its credit
  scheduler.Restore(Job("light", "large", 1.5));
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Remove("lightlarge");
  scheduler.Restore(Job("light", "1", 0.25));
  scheduler.Restore(Job("light", "2", 0.25));
  scheduler.Restore(Job("other", "1", 0.25));
  EXPECT_EQ(scheduler.StartNext()->id, "light1");
  EXPECT_FALSE(scheduler.StartNext().has_value());  // all burst cores are in use
  // Burst cores are not taken from other jobs, and other jobs do not use burst cores.
  scheduler.Finished("heavy0", 0.5);
  EXPECT_EQ(scheduler.StartNext()->id, "other1");
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Finished("light1", 0.25);
  EXPECT_EQ(scheduler.StartNext()->id, "light2");
}

TEST_F(SchedulerTest, NothingIsLentToWhoTakesMoreThanPredicted) {
  Scheduler scheduler({.cores = 1, .max_saved_core_seconds = 5, .small_core_seconds = 1, .burst_cores = 1}, clock_);
  for (int k = 0; k < 100; ++k) scheduler.Restore(Job("heavy", std::to_string(k), 10));
  ASSERT_EQ(scheduler.StartNext()->id, "heavy0");
  scheduler.Restore(Job("liar", "1", 0.1));
  scheduler.Restore(Job("liar", "2", 0.1));
  ASSERT_EQ(scheduler.StartNext()->id, "liar1");
  EXPECT_FALSE(scheduler.StartNext().has_value());  // one at a time
  scheduler.Finished("liar1", 20);
  EXPECT_FALSE(scheduler.StartNext().has_value());
}

TEST_F(SchedulerTest, MemoryIsNotLent) {
  Scheduler scheduler(
      {.cores = 2, .max_running_memory_bytes = 10, .small_core_seconds = 1, .burst_cores = 1, .max_skip_time = 30s},
      clock_);
  const auto add = [&scheduler](const std::string& owner, double core_seconds, int threads, std::int64_t memory) {
    Scheduler::Request request = Job(owner, "", core_seconds);
    request.demand.threads = threads;
    request.demand.memory_bytes = memory;
    scheduler.Restore(request);
  };
  add("heavy", 1, 1, 4);
  ASSERT_EQ(scheduler.StartNext()->id, "heavy");
  add("wide", 0.25, 2, 1);
  ASSERT_FALSE(scheduler.StartNext().has_value());
  clock_.Advance(31s);
  // Only "wide" may start on the ordinary cores. Small jobs still start beside it if there is memory.
  add("light", 0.5, 1, 7);
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Remove("light");
  add("light", 0.5, 1, 2);
  ASSERT_TRUE(scheduler.StartNext().has_value());
  EXPECT_TRUE(scheduler.Knows("light"));
  scheduler.Finished("heavy", 1);
  EXPECT_EQ(scheduler.StartNext()->id, "wide");
  scheduler.Finished("light", 0.5);
  scheduler.Finished("wide", 0.25);
  // Beside a job that waits for memory small jobs do not start.
  add("other", 1, 1, 4);
  ASSERT_EQ(scheduler.StartNext()->id, "other");
  add("hungry", 0.25, 1, 10);
  ASSERT_FALSE(scheduler.StartNext().has_value());
  clock_.Advance(31s);
  add("light", 0.5, 1, 1);
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Finished("other", 1);
  EXPECT_EQ(scheduler.StartNext()->id, "hungry");
}

TEST_F(SchedulerTest, WhoNeedsNoCoreAnyMoreKeepsItsMemoryToTheEnd) {
  Scheduler scheduler({.cores = 1, .max_running_memory_bytes = 10}, clock_);
  Scheduler::Request hungry = Job("ada", "hungry");
  hungry.demand.memory_bytes = 10;
  scheduler.Restore(hungry);
  ASSERT_EQ(scheduler.StartNext()->id, "adahungry");
  scheduler.GiveBackCores("adahungry", 1);
  scheduler.GiveBackCores("adahungry", 1);  // of nothing
  scheduler.Restore(Job("ada", "2"));
  EXPECT_FALSE(scheduler.StartNext().has_value());
  EXPECT_EQ(scheduler.running(), 1);
  scheduler.Finished("adahungry", 1);
  EXPECT_EQ(scheduler.StartNext()->id, "ada2");
  EXPECT_FALSE(scheduler.has_free_cores());
  scheduler.GiveBackCores("ada2", 1);
  EXPECT_TRUE(scheduler.has_free_cores());
  scheduler.Restore(Job("ada", "3"));
  EXPECT_EQ(scheduler.StartNext()->id, "ada3");
}

TEST_F(SchedulerTest, AJobThatIsPassedOverTooLongHoldsUpTheOthersUntilItFits) {
  Scheduler scheduler({.cores = 4, .max_running_memory_bytes = 100, .max_skip_time = 30s}, clock_);
  Scheduler::Request hungry = Job("ada", "hungry");
  hungry.demand.memory_bytes = 100;
  scheduler.Restore(Job("bob", "0"));
  EXPECT_EQ(scheduler.StartNext()->id, "bob0");
  scheduler.Restore(hungry);
  for (int k = 1; k <= 10; ++k) scheduler.Restore(Job("bob", std::to_string(k)));
  EXPECT_TRUE(scheduler.StartNext().has_value());
  clock_.Advance(29s);
  EXPECT_TRUE(scheduler.StartNext().has_value());
  clock_.Advance(2s);
  EXPECT_FALSE(scheduler.StartNext().has_value());
  scheduler.Finished("bob0", 1);
  scheduler.Finished("bob1", 1);
  scheduler.Finished("bob2", 1);
  EXPECT_EQ(scheduler.StartNext()->id, "adahungry");
}

TEST_F(SchedulerTest, RefusalsNameTheLimitAndSayWhenToComeBack) {
  const SchedulerLimits limits{.cores = 2,
                               .max_running_memory_bytes = 1000,
                               .max_job_memory_bytes = 500,
                               .max_job_core_seconds = 50,
                               .max_queued_jobs = 4,
                               .max_queued_jobs_per_user = 2,
                               .max_queued_core_seconds = 80};
  Scheduler scheduler(limits, clock_);
  Scheduler::Request request = Job("ada", "memory");
  request.demand.memory_bytes = 501;
  EXPECT_EQ(scheduler.Enqueue(request)->limit, "max_job_memory_bytes");
  EXPECT_FALSE(scheduler.Enqueue(request)->retry_after.has_value());
  EXPECT_EQ(scheduler.Enqueue(Job("ada", "work", 51))->limit, "max_job_core_seconds");

  EXPECT_FALSE(scheduler.Enqueue(Job("ada", "1", 10)).has_value());
  EXPECT_FALSE(scheduler.Enqueue(Job("ada", "2", 30)).has_value());
  const auto too_many = scheduler.Enqueue(Job("ada", "3"));
  EXPECT_EQ(too_many->limit, "max_queued_jobs_per_user");
  EXPECT_EQ(too_many->value, 2);
  EXPECT_EQ(too_many->retry_after, 10s);  // 40 core-seconds, 2 cores, 2 jobs
  const auto too_much = scheduler.Enqueue(Job("bob", "1", 44));
  EXPECT_EQ(too_much->limit, "max_queued_core_seconds");
  EXPECT_EQ(too_much->requested, 84);
  EXPECT_EQ(too_much->retry_after, 2s);
  EXPECT_FALSE(scheduler.Enqueue(Job("bob", "1")).has_value());
  EXPECT_FALSE(scheduler.Enqueue(Job("cyd", "1")).has_value());
  EXPECT_EQ(scheduler.Enqueue(Job("dan", "1"))->limit, "max_queued_jobs");

  const absl::Status status = ToStatus(*too_much);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(), "max_queued_core_seconds is 80, and this needs 84. Try again in 2 s.");
  EXPECT_EQ(RefusalOf(status)->limit, "max_queued_core_seconds");
  EXPECT_EQ(RefusalOf(status)->retry_after, 2s);
  EXPECT_FALSE(RefusalOf(absl::ResourceExhaustedError("memory")).has_value());
}

TEST_F(SchedulerTest, RefusesAtOnceWhatCannotMeetItsDeadline) {
  Scheduler scheduler({.cores = 1}, clock_);
  Scheduler::Request request = Job("ada", "late", 10);
  request.deadline = clock_.Now() + 9s;
  EXPECT_EQ(scheduler.Enqueue(request)->limit, "deadline");
  EXPECT_FALSE(scheduler.Enqueue(request)->retry_after.has_value());  // not even on an idle server
  request.deadline = clock_.Now() + 11s;
  scheduler.Restore(Job("ada", "running", 5));
  ASSERT_TRUE(scheduler.StartNext().has_value());
  EXPECT_EQ(scheduler.Enqueue(request)->retry_after, 5s);
  clock_.Advance(4500ms);
  request.deadline = clock_.Now() + 11s;
  EXPECT_FALSE(scheduler.Enqueue(request).has_value());
}

TEST_F(SchedulerTest, AnothersLongQueueDoesNotCountForALightUsersDeadline) {
  Scheduler scheduler({.cores = 1}, clock_);
  for (int k = 0; k < 100; ++k) scheduler.Restore(Job("heavy", std::to_string(k), 1));
  Scheduler::Request request = Job("light", "1", 1);
  request.deadline = clock_.Now() + 3s;  // one of the heavy user's, and its own
  EXPECT_FALSE(scheduler.Enqueue(request).has_value());
  Scheduler::Request heavy = Job("heavy", "last", 1);
  heavy.deadline = clock_.Now() + 50s;
  EXPECT_EQ(scheduler.Enqueue(heavy)->limit, "deadline");
}

TEST_F(SchedulerTest, LongJobsThatRunDoNotCountForASmallOnesDeadline) {
  Scheduler scheduler({.cores = 1, .small_core_seconds = 1, .burst_cores = 1}, clock_);
  scheduler.Restore(Job("heavy", "1", 100));
  scheduler.Restore(Job("heavy", "2", 100));
  ASSERT_TRUE(scheduler.StartNext().has_value());
  Scheduler::Request request = Job("light", "1", 1);
  request.deadline = clock_.Now() + 2s;
  EXPECT_FALSE(scheduler.Enqueue(request).has_value());
  EXPECT_EQ(scheduler.StartNext()->id, "light1");
  request = Job("light", "2", 1);
  request.deadline = clock_.Now() + 2s;
  EXPECT_EQ(scheduler.Enqueue(request)->limit, "deadline");
}

TEST_F(SchedulerTest, TellsThatThereIsNoPlaceWithoutKnowingTheJob) {
  Scheduler scheduler({.cores = 1, .max_queued_jobs = 3, .max_queued_jobs_per_user = 2}, clock_);
  EXPECT_FALSE(scheduler.RefuseIfFull("ada").has_value());
  EXPECT_FALSE(scheduler.Enqueue(Job("ada", "1")).has_value());
  EXPECT_FALSE(scheduler.Reserve(Job("ada", "2")).has_value());
  EXPECT_EQ(scheduler.RefuseIfFull("ada")->limit, "max_queued_jobs_per_user");
  EXPECT_TRUE(scheduler.RefuseIfFull("ada")->retry_after.has_value());
  EXPECT_FALSE(scheduler.RefuseIfFull("bob").has_value());
  EXPECT_FALSE(scheduler.Enqueue(Job("bob", "1")).has_value());
  EXPECT_EQ(scheduler.RefuseIfFull("bob")->limit, "max_queued_jobs");
}

TEST_F(SchedulerTest, TakesOutAnEnsembleAtItsDeadlineAndNotBefore) {
  Scheduler scheduler({.cores = 1}, clock_);
  Scheduler::Request request = Job("ada", "ensemble", 10);
  request.takes_free_cores = true;
  request.deadline = clock_.Now() + 20s;
  scheduler.Restore(request);
  clock_.Advance(20s);
  EXPECT_THAT(scheduler.TakeUnmeetable(), ElementsAre());
  clock_.Advance(1ms);
  EXPECT_THAT(scheduler.TakeUnmeetable(), ElementsAre("adaensemble"));
}

TEST_F(SchedulerTest, TakesOutWhatHasBecomeHopeless) {
  Scheduler scheduler({.cores = 1}, clock_);
  Scheduler::Request request = Job("ada", "1", 10);
  request.deadline = clock_.Now() + 20s;
  scheduler.Restore(request);
  scheduler.Restore(Job("ada", "2", 10));
  clock_.Advance(9s);
  EXPECT_THAT(scheduler.TakeUnmeetable(), ElementsAre());
  clock_.Advance(2s);
  EXPECT_THAT(scheduler.TakeUnmeetable(), ElementsAre("ada1"));
  EXPECT_EQ(scheduler.queued(), 1);
}

TEST_F(SchedulerTest, AKeptPlaceCountsButDoesNotStart) {
  Scheduler scheduler({.cores = 1, .max_queued_jobs = 2}, clock_);
  EXPECT_FALSE(scheduler.Reserve(Job("ada", "1")).has_value());
  EXPECT_FALSE(scheduler.Reserve(Job("ada", "2")).has_value());
  EXPECT_EQ(scheduler.Reserve(Job("bob", "1"))->limit, "max_queued_jobs");
  EXPECT_FALSE(scheduler.StartNext().has_value());
  EXPECT_TRUE(scheduler.Remove("ada1"));
  scheduler.Confirm("ada2");
  EXPECT_FALSE(scheduler.Reserve(Job("bob", "1")).has_value());
  EXPECT_EQ(scheduler.StartNext()->id, "ada2");
  EXPECT_EQ(scheduler.queued_core_seconds(), 1);
}

TEST_F(SchedulerTest, RemovesQueuedJobsOnly) {
  Scheduler scheduler({.cores = 1}, clock_);
  scheduler.Restore(Job("ada", "1"));
  scheduler.Restore(Job("ada", "2"));
  ASSERT_EQ(scheduler.StartNext()->id, "ada1");
  EXPECT_FALSE(scheduler.Remove("ada1"));
  EXPECT_TRUE(scheduler.Remove("ada2"));
  EXPECT_FALSE(scheduler.Remove("ada2"));
  EXPECT_TRUE(scheduler.Knows("ada1"));
  scheduler.Finished("ada1", 1);
  EXPECT_FALSE(scheduler.Knows("ada1"));
  scheduler.Finished("ada1", 1);  // of nothing
  EXPECT_EQ(scheduler.running(), 0);
}

}  // namespace
}  // namespace dlcs::jobs
