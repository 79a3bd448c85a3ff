// SPDX-License-Identifier: Apache-2.0
#include "tests/server/store/job_store_contract.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/store/job_samples.h"

namespace dlcs::jobs::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kAll = 1000;

// "1 QUEUED", "2 RUNNING", ...
std::vector<std::string> EventsOf(JobStore& store, const JobId& id, std::int64_t after = 0, int limit = kAll) {
  std::vector<std::string> texts;
  const auto events = store.ReadEvents(id, after, limit);
  EXPECT_TRUE(events.ok()) << events.status();
  for (const Event& event : *events) texts.push_back(std::to_string(event.sequence) + " " + *event.payload);
  return texts;
}

JobId Submit(JobStore& store, const NewJob& job = SampleJob()) {
  const auto created = store.Create(job);
  EXPECT_TRUE(created.ok()) << created.status();
  return created->job.id;
}

ClaimedJob Claim(JobStore& store, const JobId& id, const std::string& worker = "worker", Duration lease = 30s) {
  const JobId candidates[] = {id};
  auto claimed = store.Claim(worker, lease, candidates);
  EXPECT_TRUE(claimed.ok()) << claimed.status();
  EXPECT_TRUE(claimed->has_value());
  return **claimed;
}

bool CanClaim(JobStore& store, const JobId& id) {
  const auto jobs = store.ListClaimable(kAll);
  EXPECT_TRUE(jobs.ok()) << jobs.status();
  return std::any_of(jobs->begin(), jobs->end(), [&id](const Job& job) { return job.id == id; });
}

absl::StatusCode CodeOf(const absl::Status& status) { return status.code(); }

TEST_P(JobStoreContractTest, RemembersWhatWasAsked) {
  NewJob job = SampleJob("ada", std::string("body\0with zero", 14));
  job.priority = 7;
  job.deadline = Time(Duration(1'800'000'000'000'000));
  const JobId id = Submit(store_, job);
  for (JobStore* store : {&store_, &shared_->other()}) {
    const auto found = store->Get("ada", id);
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(found->owner, "ada");
    EXPECT_EQ(found->priority, 7);
    EXPECT_EQ(found->demand.core_seconds, 2.5);
    EXPECT_EQ(found->demand.memory_bytes, 1000);
    EXPECT_EQ(found->demand.threads, 2);
    EXPECT_EQ(found->deadline, job.deadline);
    EXPECT_EQ(found->state, JobState::kQueued);
    EXPECT_EQ(found->sequence, 1);
    EXPECT_FALSE(found->started.has_value());
    EXPECT_FALSE(found->finished.has_value());
  }
  EXPECT_THAT(EventsOf(store_, id), ElementsAre("1 QUEUED"));
  EXPECT_EQ(Claim(store_, id).body, job.body);
  EXPECT_TRUE(store_.Healthy());
  EXPECT_TRUE(store_.Probe().ok());
}

TEST_P(JobStoreContractTest, TheSameRequestTwiceIsOneJob) {
  NewJob first = SampleJob();
  first.request_id = "r1";
  first.body_hash = "hash";
  NewJob again = first;
  again.id = NewJobId();
  ASSERT_TRUE(store_.Create(first).ok());
  const auto second = shared_->other().Create(again);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_TRUE(second->existed);
  EXPECT_EQ(second->job.id, first.id);
  EXPECT_EQ((*store_.FindRequest("ada", "r1", "hash"))->id, first.id);
  EXPECT_FALSE((*store_.FindRequest("ada", "r2", "hash")).has_value());

  NewJob changed = again;
  changed.body_hash = "another hash";
  EXPECT_EQ(CodeOf(store_.Create(changed).status()), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(CodeOf(store_.FindRequest("ada", "r1", "another hash").status()), absl::StatusCode::kAlreadyExists);

  // Another owner's r1 is another request, and no request_id at all never matches.
  NewJob elsewhere = changed;
  elsewhere.owner = "bob";
  EXPECT_FALSE(store_.Create(elsewhere)->existed);
  EXPECT_FALSE(store_.Create(SampleJob())->existed);
  EXPECT_FALSE(store_.Create(SampleJob())->existed);
}

TEST_P(JobStoreContractTest, MeasuresWhatCanBeClaimed) {
  EXPECT_EQ(store_.MeasureQueue()->jobs, 0);
  EXPECT_EQ(store_.MeasureQueue()->core_seconds, 0);
  EXPECT_EQ(store_.MeasureQueue()->oldest_age, Duration::zero());
  const JobId first = Submit(store_);
  Submit(store_);
  std::this_thread::sleep_for(2ms);
  auto depth = shared_->other().MeasureQueue();
  ASSERT_TRUE(depth.ok()) << depth.status();
  EXPECT_EQ(depth->jobs, 2);
  EXPECT_EQ(depth->core_seconds, 5);
  const Duration age = depth->oldest_age;
  const ClaimedJob claimed = Claim(store_, first);
  depth = store_.MeasureQueue();
  EXPECT_EQ(depth->jobs, 1);
  ASSERT_TRUE(store_.Release(claimed.lease, 9, false).ok());
  depth = store_.MeasureQueue();
  EXPECT_EQ(depth->jobs, 2);
  EXPECT_GE(depth->oldest_age, age);  // of the job, not of its place in the queue
}

TEST_P(JobStoreContractTest, UsersSeeTheirOwnJobsOnly) {
  const JobId id = Submit(store_, SampleJob("ada"));
  EXPECT_EQ(CodeOf(store_.Get("bob", id).status()), absl::StatusCode::kNotFound);
  EXPECT_EQ(CodeOf(store_.RequestCancel("bob", id).status()), absl::StatusCode::kNotFound);
  EXPECT_EQ(CodeOf(store_.Delete("bob", id)), absl::StatusCode::kNotFound);
  EXPECT_THAT(store_.List({.owner = "bob", .states = {}}, 10, "")->jobs, IsEmpty());
  EXPECT_TRUE(store_.Get(std::nullopt, id).ok());
  EXPECT_EQ(store_.List({.owner = std::nullopt, .states = {}}, 10, "")->jobs.size(), 1u);
}

TEST_P(JobStoreContractTest, NamesOfNoJobAreNotFoundAndNotRepeated) {
  for (const std::string name : {"../../etc/passwd", "' OR 1=1 --", "", "x\n"}) {
    const absl::Status status = store_.Get(std::nullopt, name).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
    EXPECT_EQ(status.message(), "There is no job of that name.");
  }
  EXPECT_THAT(std::string(store_.Get(std::nullopt, NewJobId()).status().message()), HasSubstr("There is no job "));
  NewJob job = SampleJob();
  job.id = "../name";
  EXPECT_EQ(CodeOf(store_.Create(job).status()), absl::StatusCode::kInvalidArgument);
}

TEST_P(JobStoreContractTest, ListsInPagesNewestFirstWhileJobsAreAdded) {
  std::vector<JobId> ids;
  for (int k = 0; k < 25; ++k) ids.push_back(Submit(store_, SampleJob(k % 5 == 0 ? "bob" : "ada")));
  std::vector<JobId> listed;
  std::string token;
  do {
    const auto page = store_.List({.owner = "ada", .states = {}}, 7, token);
    ASSERT_TRUE(page.ok()) << page.status();
    EXPECT_LE(page->jobs.size(), 7u);
    for (const Job& job : page->jobs) listed.push_back(job.id);
    token = page->next_page_token;
    Submit(store_, SampleJob("ada"));  // newer than the first page: does not shift the others
  } while (!token.empty());
  std::vector<JobId> expected;
  for (int k = 24; k >= 0; --k) {
    if (k % 5 != 0) expected.push_back(ids[k]);
  }
  EXPECT_EQ(listed, expected);
  for (const std::string bad : {"x", "-1", "0", "1 ", "99999999999999999999"}) {
    EXPECT_EQ(CodeOf(store_.List({}, 7, bad).status()), absl::StatusCode::kInvalidArgument) << bad;
  }
  EXPECT_EQ(CodeOf(store_.List({}, 0, "").status()), absl::StatusCode::kInvalidArgument);
}

TEST_P(JobStoreContractTest, ListsByState) {
  const JobId queued = Submit(store_);
  const JobId running = Submit(store_);
  const JobId cancelled = Submit(store_);
  Claim(store_, running);
  ASSERT_TRUE(store_.RequestCancel("ada", cancelled).ok());
  const auto ids = [this](std::vector<JobState> states) {
    std::vector<JobId> result;
    const auto page = store_.List({.owner = "ada", .states = std::move(states)}, 10, "");
    EXPECT_TRUE(page.ok()) << page.status();
    for (const Job& job : page->jobs) result.push_back(job.id);
    return result;
  };
  EXPECT_THAT(ids({JobState::kQueued}), ElementsAre(queued));
  EXPECT_THAT(ids({JobState::kRunning, JobState::kCancelled}), ElementsAre(cancelled, running));
  EXPECT_THAT(ids({JobState::kFailed}), IsEmpty());
}

TEST_P(JobStoreContractTest, RunsFromClaimToSummary) {
  const JobId id = Submit(store_);
  const ClaimedJob claimed = Claim(store_, id);
  EXPECT_EQ(claimed.job.state, JobState::kRunning);
  EXPECT_EQ(claimed.job.sequence, 2);
  EXPECT_EQ(claimed.job.attempts, 1);
  EXPECT_TRUE(claimed.job.started.has_value());
  EXPECT_FALSE(claimed.resume_state.has_value());
  ASSERT_TRUE(store_.Append(claimed.lease, SampleWindow(0, 10)).ok());
  ASSERT_TRUE(store_.Append(claimed.lease, SampleWindow(1, 20)).ok());
  ASSERT_TRUE(store_.Append(claimed.lease, {.chunks = {}, .state = {}, .events = {}, .reserve_through = 5000}).ok());
  EXPECT_EQ(store_.Get("ada", id)->sequence, 5000);
  EXPECT_EQ(store_.Get("ada", id)->last_event, 20);
  EXPECT_EQ(store_.Get("ada", id)->chunks, 2);
  EXPECT_DOUBLE_EQ(store_.Get("ada", id)->progress, 0.02);
  ASSERT_TRUE(store_.Finish(claimed.lease, SampleEnd(30)).ok());

  const auto done = store_.Get("ada", id);
  EXPECT_EQ(done->state, JobState::kSucceeded);
  EXPECT_EQ(done->sequence, 32);
  EXPECT_EQ(done->progress, 1);
  EXPECT_EQ(done->tally, "it ended");
  EXPECT_TRUE(done->finished.has_value());
  EXPECT_THAT(EventsOf(store_, id),
              ElementsAre("1 QUEUED", "2 RUNNING", "10 window 0", "20 window 1", "31 SUCCEEDED", "32 the end"));
  EXPECT_THAT(EventsOf(store_, id, 10, 2), ElementsAre("20 window 1", "31 SUCCEEDED"));
  EXPECT_FALSE(CanClaim(store_, id));
}

TEST_P(JobStoreContractTest, KeepsEveryByteOfAnEventAndAChunk) {
  const ClaimedJob claimed = Claim(store_, Submit(store_));
  Progress progress = SampleWindow(0, 3);
  progress.events[0].payload = std::make_shared<const std::string>(std::string("\0\x01\xff\n", 4));
  progress.chunks[0].data = std::string(3'000'000, '\xa5');
  progress.chunks[0].begin = 0.1;
  ASSERT_TRUE(store_.Append(claimed.lease, progress).ok());
  const auto events = shared_->other().ReadEvents(claimed.job.id, 2, 1);
  EXPECT_EQ(*events->at(0).payload, *progress.events[0].payload);
  EXPECT_EQ(events->at(0).time, progress.events[0].time);
  EXPECT_EQ(events->at(0).kind, EventKind::kWindowAccepted);
  const auto chunks = shared_->other().ReadChunks(claimed.job.id, 0, 1);
  EXPECT_EQ(chunks->at(0).data, progress.chunks[0].data);
  EXPECT_EQ(chunks->at(0).begin, 0.1);
  EXPECT_EQ(store_.Get("ada", claimed.job.id)->stored_bytes, static_cast<std::int64_t>(std::string("a problem"
                                                                                                   "QUEUED"
                                                                                                   "RUNNING")
                                                                                           .size()) +
                                                                 4 + 3'000'000);
}

TEST_P(JobStoreContractTest, ReadsTheTrajectoryInBoundedParts) {
  const ClaimedJob claimed = Claim(store_, Submit(store_));
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(store_.Append(claimed.lease, SampleWindow(k, 10 + k)).ok());
  const auto numbers = [&](std::int64_t from, std::int64_t bytes) {
    std::vector<std::int64_t> result;
    const auto chunks = store_.ReadChunks(claimed.job.id, from, bytes);
    EXPECT_TRUE(chunks.ok()) << chunks.status();
    for (const Chunk& chunk : *chunks) result.push_back(chunk.number);
    return result;
  };
  EXPECT_THAT(numbers(0, 1), ElementsAre(0));
  EXPECT_THAT(numbers(4, 30), ElementsAre(4, 5, 6));  // 9 bytes each
  EXPECT_THAT(numbers(8, 1000), ElementsAre(8, 9));
  EXPECT_THAT(numbers(10, 1000), IsEmpty());
}

TEST_P(JobStoreContractTest, AWriteMayBeRepeated) {
  const JobId id = Submit(store_);
  const ClaimedJob claimed = Claim(store_, id);
  for (int k = 0; k < 2; ++k) {
    ASSERT_TRUE(store_.Append(claimed.lease, SampleWindow(0, 10)).ok());
  }
  EXPECT_EQ(store_.Get("ada", id)->chunks, 1);
  const std::int64_t bytes = store_.Get("ada", id)->stored_bytes;
  ASSERT_TRUE(store_.Append(claimed.lease, SampleWindow(0, 10)).ok());
  EXPECT_EQ(store_.Get("ada", id)->stored_bytes, bytes);
  for (int k = 0; k < 2; ++k) ASSERT_TRUE(store_.Finish(claimed.lease, SampleEnd(20)).ok());
  EXPECT_THAT(EventsOf(store_, id), ElementsAre("1 QUEUED", "2 RUNNING", "10 window 0", "21 SUCCEEDED", "22 the end"));
}

TEST_P(JobStoreContractTest, AppendIsAllOrNothing) {
  const JobId id = Submit(store_);
  const ClaimedJob claimed = Claim(store_, id);
  Progress holes = SampleWindow(0, 10);
  holes.chunks.push_back({.number = 2, .begin = 2, .end = 3, .data = "after a hole"});
  EXPECT_EQ(CodeOf(store_.Append(claimed.lease, holes)), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(store_.Get("ada", id)->chunks, 0);
  EXPECT_THAT(EventsOf(store_, id), ElementsAre("1 QUEUED", "2 RUNNING"));
}

TEST_P(JobStoreContractTest, OneWorkerGetsAJobAndItsLeaseRunsOut) {
  const JobId id = Submit(store_);
  const ClaimedJob first = Claim(store_, id, "one", 30s);
  EXPECT_FALSE(CanClaim(shared_->other(), id));
  const JobId candidates[] = {id};
  EXPECT_FALSE((*shared_->other().Claim("other", 30s, candidates)).has_value());
  ASSERT_TRUE(store_.Append(first.lease, SampleWindow(0, 10)).ok());

  shared_->Advance(20s);
  EXPECT_FALSE(*store_.RenewLease(first.lease, 30s));
  shared_->Advance(20s);
  EXPECT_FALSE(CanClaim(shared_->other(), id));
  shared_->Advance(11s);
  ASSERT_TRUE(CanClaim(shared_->other(), id));
  // Late, but no other worker claimed the job: the lease is still valid.
  EXPECT_TRUE(store_.Append(first.lease, {.chunks = {}, .state = {}, .events = {}, .reserve_through = 4000}).ok());

  const ClaimedJob second = Claim(shared_->other(), id, "other", 30s);
  EXPECT_GT(second.lease.fence, first.lease.fence);
  EXPECT_EQ(second.resume_state, "state 0");
  EXPECT_EQ(second.job.chunks, 1);
  EXPECT_EQ(second.job.sequence, 4001) << "numbers go on above all that the first may have shown";
  // Whatever the first does now is refused.
  EXPECT_EQ(CodeOf(store_.Append(first.lease, SampleWindow(1, 11))), absl::StatusCode::kAborted);
  EXPECT_EQ(CodeOf(store_.RenewLease(first.lease, 30s).status()), absl::StatusCode::kAborted);
  EXPECT_EQ(CodeOf(store_.Finish(first.lease, SampleEnd(12))), absl::StatusCode::kAborted);
  EXPECT_EQ(CodeOf(store_.Release(first.lease, 12, false)), absl::StatusCode::kAborted);
  ASSERT_TRUE(shared_->other().Append(second.lease, SampleWindow(1, 4002)).ok());
  ASSERT_TRUE(shared_->other().Finish(second.lease, SampleEnd(4002)).ok());
  EXPECT_EQ(CodeOf(store_.Finish(first.lease, SampleEnd(12))), absl::StatusCode::kAborted);
  EXPECT_THAT(EventsOf(store_, id), ElementsAre("1 QUEUED", "2 RUNNING", "10 window 0", "4001 RUNNING", "4002 window 1",
                                                "4003 SUCCEEDED", "4004 the end"));
}

TEST_P(JobStoreContractTest, ClaimsTheFirstCandidateThatIsFree) {
  const JobId taken = Submit(store_);
  const JobId free = Submit(store_);
  const JobId also_free = Submit(store_);
  Claim(store_, taken);
  const JobId candidates[] = {NewJobId(), taken, also_free, free};
  EXPECT_EQ((*store_.Claim("w", 30s, candidates))->job.id, also_free);
  EXPECT_EQ((*store_.Claim("w", 30s, candidates))->job.id, free);
  EXPECT_FALSE((*store_.Claim("w", 30s, candidates)).has_value());
}

TEST_P(JobStoreContractTest, ManyWorkersNeverShareAJob) {
  std::vector<JobId> ids;
  for (int k = 0; k < 60; ++k) ids.push_back(Submit(store_));
  std::vector<std::vector<JobId>> got(4);
  std::vector<std::thread> workers;
  for (int w = 0; w < 4; ++w) {
    workers.emplace_back([&, w] {
      JobStore& store = w % 2 == 0 ? shared_->one() : shared_->other();
      for (;;) {
        const auto claimed = store.Claim("worker " + std::to_string(w), 30s, ids);
        if (!claimed.ok() || !claimed->has_value()) return;
        got[w].push_back((*claimed)->job.id);
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  std::multiset<JobId> all;
  for (const auto& part : got) all.insert(part.begin(), part.end());
  EXPECT_EQ(all, std::multiset<JobId>(ids.begin(), ids.end()));
}

TEST_P(JobStoreContractTest, AServerThatRestartsGetsItsOwnJobsBackAtOnce) {
  const JobId mine = Submit(store_);
  const JobId others = Submit(store_);
  const ClaimedJob before = Claim(store_, mine, "me");
  Claim(store_, others, "somebody else");
  EXPECT_EQ(*store_.ReleaseLeases("me"), 1);
  EXPECT_EQ(*store_.ReleaseLeases("me"), 0);
  EXPECT_TRUE(CanClaim(store_, mine));
  EXPECT_FALSE(CanClaim(store_, others));
  const ClaimedJob after = Claim(store_, mine, "me");
  EXPECT_EQ(after.job.attempts, 2);
  EXPECT_EQ(CodeOf(store_.Finish(before.lease, SampleEnd(10))), absl::StatusCode::kAborted);
}

TEST_P(JobStoreContractTest, CountsAttemptsSinceTheJobLastGotOn) {
  const JobId id = Submit(store_);
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(Claim(store_, id).job.attempts, attempt);
    ASSERT_TRUE(store_.ReleaseLeases("worker").ok());
  }
  const ClaimedJob claimed = Claim(store_, id);
  ASSERT_TRUE(store_.Append(claimed.lease, SampleWindow(0, 100)).ok());
  EXPECT_EQ(store_.Get("ada", id)->attempts, 1);
}

TEST_P(JobStoreContractTest, AJobGivenBackGoesOnElsewhere) {
  const JobId id = Submit(store_);
  const ClaimedJob first = Claim(store_, id, "one");
  ASSERT_TRUE(store_.Append(first.lease, SampleWindow(0, 10)).ok());
  ASSERT_TRUE(store_.Append(first.lease, {.chunks = {}, .state = {}, .events = {}, .reserve_through = 9000}).ok());
  ASSERT_TRUE(store_.Release(first.lease, 15, false).ok());
  EXPECT_EQ(store_.Get("ada", id)->state, JobState::kQueued);
  EXPECT_EQ(CodeOf(store_.Append(first.lease, SampleWindow(1, 16))), absl::StatusCode::kAborted);
  const ClaimedJob second = Claim(shared_->other(), id, "other");
  EXPECT_EQ(second.resume_state, "state 0");
  EXPECT_EQ(second.job.attempts, 1);
  EXPECT_THAT(EventsOf(store_, id), ElementsAre("1 QUEUED", "2 RUNNING", "10 window 0", "16 QUEUED", "17 RUNNING"));
}

TEST_P(JobStoreContractTest, AnAttemptInVainCounts) {
  const JobId id = Submit(store_);
  for (int attempt = 1; attempt <= 3; ++attempt) {
    const ClaimedJob claimed = Claim(store_, id);
    EXPECT_EQ(claimed.job.attempts, attempt);
    ASSERT_TRUE(store_.Release(claimed.lease, claimed.job.sequence, true).ok());
  }
  const ClaimedJob moves = Claim(store_, id);
  ASSERT_TRUE(store_.Append(moves.lease, SampleWindow(0, moves.job.sequence + 1)).ok());
  ASSERT_TRUE(store_.Release(moves.lease, moves.job.sequence + 1, true).ok());
  EXPECT_EQ(Claim(store_, id).job.attempts, 2);
}

TEST_P(JobStoreContractTest, CancelEndsAQueuedJobAndTellsTheWorkerOfARunningOne) {
  const JobId queued = Submit(store_);
  EXPECT_EQ(store_.RequestCancel("ada", queued)->state, JobState::kCancelled);
  EXPECT_THAT(EventsOf(store_, queued), ElementsAre("1 QUEUED", "2 CANCELLED", "3 "));
  EXPECT_EQ(store_.ReadEvents(queued, 2, 1)->at(0).kind, EventKind::kSummary);
  EXPECT_FALSE(CanClaim(store_, queued));
  EXPECT_EQ(store_.RequestCancel("ada", queued)->state, JobState::kCancelled);

  const JobId running = Submit(store_);
  const ClaimedJob claimed = Claim(store_, running);
  EXPECT_FALSE(*store_.RenewLease(claimed.lease, 30s));
  EXPECT_EQ(shared_->other().RequestCancel("ada", running)->state, JobState::kCancelling);
  EXPECT_EQ(shared_->other().RequestCancel("ada", running)->state, JobState::kCancelling);
  EXPECT_TRUE(*store_.RenewLease(claimed.lease, 30s));
  ASSERT_TRUE(store_.Finish(claimed.lease, SampleEnd(2, JobState::kCancelled)).ok());
  EXPECT_EQ(store_.RequestCancel("ada", running)->state, JobState::kCancelled);
}

TEST_P(JobStoreContractTest, ACancelSurvivesTheWorkerThatHeardIt) {
  const JobId id = Submit(store_);
  const ClaimedJob first = Claim(store_, id, "one");
  ASSERT_TRUE(store_.RequestCancel("ada", id).ok());
  ASSERT_TRUE(store_.ReleaseLeases("one").ok());
  EXPECT_EQ(Claim(store_, id, "one").job.state, JobState::kCancelling);
  ASSERT_TRUE(store_.ReleaseLeases("one").ok());
  const ClaimedJob third = Claim(store_, id, "one");
  ASSERT_TRUE(store_.Release(third.lease, third.job.sequence, false).ok());
  EXPECT_EQ(store_.Get("ada", id)->state, JobState::kCancelling);
  EXPECT_TRUE(CanClaim(store_, id));
}

TEST_P(JobStoreContractTest, RemembersWhyAJobFailed) {
  const ClaimedJob claimed = Claim(store_, Submit(store_));
  ASSERT_TRUE(store_.Finish(claimed.lease, SampleEnd(2, JobState::kFailed)).ok());
  EXPECT_EQ(store_.Get("ada", claimed.job.id)->error, absl::InternalError("it broke"));
  Outcome unfinished = SampleEnd(2);
  unfinished.state = JobState::kRunning;
  EXPECT_EQ(CodeOf(store_.Finish(claimed.lease, unfinished)), absl::StatusCode::kInvalidArgument);
}

TEST_P(JobStoreContractTest, DeletesFinishedJobsWithAllThatBelongsToThem) {
  const JobId id = Submit(store_);
  EXPECT_EQ(CodeOf(store_.Delete("ada", id)), absl::StatusCode::kFailedPrecondition);
  const ClaimedJob claimed = Claim(store_, id);
  EXPECT_EQ(CodeOf(store_.Delete("ada", id)), absl::StatusCode::kFailedPrecondition);
  ASSERT_TRUE(store_.Append(claimed.lease, SampleWindow(0, 10)).ok());
  ASSERT_TRUE(store_.Finish(claimed.lease, SampleEnd(10)).ok());
  ASSERT_TRUE(store_.Delete("ada", id).ok());
  EXPECT_EQ(CodeOf(store_.Get("ada", id).status()), absl::StatusCode::kNotFound);
  EXPECT_THAT(*store_.ReadEvents(id, 0, kAll), IsEmpty());
  EXPECT_THAT(*store_.ReadChunks(id, 0, 1000), IsEmpty());
  EXPECT_EQ(CodeOf(store_.Finish(claimed.lease, SampleEnd(10))), absl::StatusCode::kAborted);
}

TEST_P(JobStoreContractTest, FinishedJobsExpireByAge) {
  std::vector<JobId> ids;
  for (int k = 0; k < 4; ++k) {
    ids.push_back(Submit(store_));
    ASSERT_TRUE(store_.Finish(Claim(store_, ids.back()).lease, SampleEnd(2)).ok());
    shared_->Advance(1h);
  }
  const JobId queued = Submit(store_);
  EXPECT_EQ(*store_.Expire({.max_age = 150min}), 2);  // 4 h and 3 h old; the others 2 h and 1 h
  EXPECT_FALSE(store_.Get("ada", ids[1]).ok());
  EXPECT_TRUE(store_.Get("ada", ids[2]).ok());
  shared_->Advance(24h * 365);
  EXPECT_EQ(*store_.Expire({.max_age = 150min}), 2);
  EXPECT_TRUE(store_.Get("ada", queued).ok());
}

TEST_P(JobStoreContractTest, FinishedJobsExpireByTotalSizeOldestFirst) {
  std::vector<JobId> ids;
  for (int k = 0; k < 5; ++k) {
    ids.push_back(Submit(store_, SampleJob("ada", std::string(1000, 'b'))));
    ASSERT_TRUE(store_.Finish(Claim(store_, ids.back()).lease, SampleEnd(2)).ok());
    shared_->Advance(1s);
  }
  EXPECT_EQ(*store_.Expire({.max_age = 24h, .max_finished_bytes = 10'000}), 0);
  EXPECT_EQ(*store_.Expire({.max_age = 24h, .max_finished_bytes = 2500}), 3);
  EXPECT_FALSE(store_.Get("ada", ids[2]).ok());
  EXPECT_TRUE(store_.Get("ada", ids[3]).ok());
  EXPECT_TRUE(store_.Get("ada", ids[4]).ok());
}

TEST_P(JobStoreContractTest, OldestFirstAmongTheClaimable) {
  std::vector<JobId> ids;
  for (int k = 0; k < 5; ++k) ids.push_back(Submit(store_));
  const auto jobs = store_.ListClaimable(3);
  ASSERT_EQ(jobs->size(), 3u);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(jobs->at(k).id, ids[k]);
}

}  // namespace
}  // namespace dlcs::jobs::testing
