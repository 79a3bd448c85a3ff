// SPDX-License-Identifier: Apache-2.0
// What every ProblemStore must do, beside the JobStore that it shares a database with.
#include <gmock/gmock.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "server/store/problem_store.h"
#include "server/store/refusal.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/job_store_contract.h"

namespace dlcs::jobs::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const std::string kBody("a matrix\0and another\xff", 21);
constexpr Expiry kUnusedForADay{.max_age = 24h * 365, .max_finished_bytes = 1 << 30, .max_unused_problem_age = 24h};

// An id that `digit` makes.
ProblemId Id(char digit) { return ProblemId(64, digit); }

absl::StatusOr<ProblemStore::Added> Add(ProblemStore& store, const std::string& owner, const ProblemId& id,
                                        const std::string& body = kBody, const ProblemQuota& quota = {}) {
  return store.AddProblem({.owner = owner, .id = id, .about = "about " + body, .body = body}, quota);
}

JobId SubmitNaming(JobStore& store, const ProblemId& id) {
  NewJob job = SampleJob("ada");
  job.problem = id;
  const auto created = store.Create(job);
  EXPECT_TRUE(created.ok()) << created.status();
  return job.id;
}

std::vector<ProblemId> Listed(ProblemStore& store, const std::string& owner) {
  std::vector<ProblemId> ids;
  const auto page = store.ListProblems(owner, 1000, "");
  EXPECT_TRUE(page.ok()) << page.status();
  for (const StoredProblem& problem : page->problems) ids.push_back(problem.id);
  return ids;
}

// The limit that refused.
std::string LimitOf(const absl::Status& status) {
  const std::optional<Refusal> refusal = RefusalOf(status);
  return refusal ? refusal->limit : status.ToString();
}

TEST_P(ProblemStoreContractTest, IsStoredOnceForAllServers) {
  const auto first = Add(problems_, "ada", Id('a'));
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_FALSE(first->existed);
  EXPECT_EQ(first->problem.bytes, static_cast<std::int64_t>(kBody.size()));
  const auto again = shared_->other_problems().AddProblem({.owner = "ada", .id = Id('a'), .about = "", .body = ""}, {});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->existed);
  for (ProblemStore* store : {&problems_, &shared_->other_problems()}) {
    const auto found = store->GetProblem("ada", Id('a'));
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(found->about, "about " + kBody);
    EXPECT_EQ(found->bytes, static_cast<std::int64_t>(kBody.size()));
    EXPECT_EQ(*store->ReadProblem("ada", Id('a')), kBody);
  }
}

TEST_P(ProblemStoreContractTest, IsItsOwnersAlone) {
  ASSERT_TRUE(Add(problems_, "ada", Id('a')).ok());
  EXPECT_TRUE(absl::IsNotFound(problems_.GetProblem("bob", Id('a')).status()));
  EXPECT_TRUE(absl::IsNotFound(problems_.ReadProblem("bob", Id('a')).status()));
  EXPECT_TRUE(absl::IsNotFound(problems_.DeleteProblem("bob", Id('a'))));
  EXPECT_THAT(Listed(problems_, "bob"), IsEmpty());
  NewJob job = SampleJob("bob");
  job.problem = Id('a');
  EXPECT_TRUE(absl::IsNotFound(store_.Create(job).status()));
  EXPECT_THAT(store_.List({.owner = std::nullopt, .states = {}}, 10, "")->jobs, IsEmpty()) << "half a job";

  EXPECT_FALSE(Add(problems_, "bob", Id('a'), "bob's")->existed);
  EXPECT_EQ(*problems_.ReadProblem("ada", Id('a')), kBody);
  ASSERT_TRUE(problems_.DeleteProblem("bob", Id('a')).ok());
  EXPECT_THAT(Listed(problems_, "ada"), ElementsAre(Id('a')));
}

TEST_P(ProblemStoreContractTest, StaysWithinTheQuotaOfItsOwner) {
  const ProblemQuota quota{.max_bytes = 10, .max_problems = 3};
  ASSERT_TRUE(Add(problems_, "ada", Id('a'), "12345", quota).ok());
  EXPECT_EQ(LimitOf(Add(problems_, "ada", Id('b'), "123456", quota).status()), "max_uploaded_bytes_per_user");
  ASSERT_TRUE(Add(problems_, "ada", Id('b'), "1234", quota).ok());
  ASSERT_TRUE(Add(problems_, "ada", Id('c'), "1", quota).ok());
  EXPECT_EQ(LimitOf(Add(problems_, "ada", Id('d'), "", quota).status()), "max_uploaded_problems_per_user");
  EXPECT_TRUE(Add(problems_, "ada", Id('a'), "12345", quota)->existed) << "what is there costs nothing";
  EXPECT_TRUE(Add(problems_, "bob", Id('d'), "1234567890", quota).ok()) << "another user's quota";
  EXPECT_THAT(Listed(problems_, "ada"), ElementsAre(Id('c'), Id('b'), Id('a')));
  ASSERT_TRUE(problems_.DeleteProblem("ada", Id('a')).ok());
  EXPECT_TRUE(Add(problems_, "ada", Id('d'), "12345", quota).ok());
}

TEST_P(ProblemStoreContractTest, ListsByPages) {
  for (const char digit : {'1', '2', '3', '4', '5'}) ASSERT_TRUE(Add(problems_, "ada", Id(digit)).ok());
  std::vector<ProblemId> ids;
  std::string token;
  int pages = 0;
  do {
    const auto page = problems_.ListProblems("ada", 2, token);
    ASSERT_TRUE(page.ok()) << page.status();
    for (const StoredProblem& problem : page->problems) ids.push_back(problem.id);
    token = page->next_page_token;
    ++pages;
  } while (!token.empty());
  EXPECT_EQ(pages, 3);
  EXPECT_THAT(ids, ElementsAre(Id('5'), Id('4'), Id('3'), Id('2'), Id('1')));
  EXPECT_TRUE(absl::IsInvalidArgument(problems_.ListProblems("ada", 2, "first, please").status()));
  EXPECT_TRUE(absl::IsInvalidArgument(problems_.ListProblems("ada", 0, "").status()));
}

TEST_P(ProblemStoreContractTest, ExpiresWhenNobodyUsesIt) {
  ASSERT_TRUE(Add(problems_, "ada", Id('a')).ok());
  ASSERT_TRUE(Add(problems_, "ada", Id('b')).ok());
  ASSERT_TRUE(Add(problems_, "ada", Id('c')).ok());
  shared_->Advance(20h);
  ASSERT_TRUE(problems_.ReadProblem("ada", Id('a')).ok());  // a use
  ASSERT_TRUE(Add(problems_, "ada", Id('b'))->existed);     // another
  shared_->Advance(5h);
  ASSERT_TRUE(store_.Expire(kUnusedForADay).ok());
  EXPECT_THAT(Listed(problems_, "ada"), ElementsAre(Id('b'), Id('a')));
  EXPECT_TRUE(absl::IsNotFound(problems_.ReadProblem("ada", Id('c')).status()));
  shared_->Advance(20h);
  ASSERT_TRUE(store_.Expire(kUnusedForADay).ok());
  EXPECT_THAT(Listed(problems_, "ada"), IsEmpty());
}

TEST_P(ProblemStoreContractTest, StaysWhileAJobNeedsIt) {
  ASSERT_TRUE(Add(problems_, "ada", Id('a')).ok());
  const JobId queued = SubmitNaming(store_, Id('a'));
  const JobId ends = SubmitNaming(store_, Id('a'));
  EXPECT_EQ(store_.Get("ada", queued)->problem, Id('a'));
  const JobId candidates[] = {ends};
  const auto claimed = store_.Claim("worker", 30s, candidates);
  ASSERT_TRUE(claimed.ok() && claimed->has_value());
  EXPECT_EQ((*claimed)->job.problem, Id('a'));
  shared_->Advance(100h);
  ASSERT_TRUE(store_.Expire(kUnusedForADay).ok());
  EXPECT_THAT(Listed(problems_, "ada"), ElementsAre(Id('a')));
  EXPECT_TRUE(absl::IsFailedPrecondition(problems_.DeleteProblem("ada", Id('a'))));
  // A job of another user who uploaded the same problem does not keep it.
  ASSERT_TRUE(Add(problems_, "bob", Id('a')).ok());
  EXPECT_TRUE(problems_.DeleteProblem("bob", Id('a')).ok());

  ASSERT_TRUE(store_.Finish((*claimed)->lease, SampleEnd((*claimed)->job.sequence)).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(problems_.DeleteProblem("ada", Id('a')))) << "one of two jobs";
  ASSERT_TRUE(store_.RequestCancel("ada", queued).ok());
  ASSERT_TRUE(store_.Expire(kUnusedForADay).ok());
  EXPECT_THAT(Listed(problems_, "ada"), IsEmpty());
  EXPECT_EQ(store_.Get("ada", ends)->problem, Id('a')) << "what a job solved is remembered";
}

TEST_P(ProblemStoreContractTest, ANewJobIsAUse) {
  ASSERT_TRUE(Add(problems_, "ada", Id('a')).ok());
  shared_->Advance(20h);
  const JobId job = SubmitNaming(store_, Id('a'));
  ASSERT_TRUE(store_.RequestCancel("ada", job).ok());
  shared_->Advance(20h);
  ASSERT_TRUE(store_.Expire(kUnusedForADay).ok());
  EXPECT_THAT(Listed(problems_, "ada"), ElementsAre(Id('a')));
}

TEST_P(ProblemStoreContractTest, WhatIsNoIdIsNotFoundAndNotRepeated) {
  for (const std::string id : {"../../etc/passwd", "' OR 1=1 --", "", "x\n"}) {
    const absl::Status status = problems_.GetProblem("ada", id).status();
    EXPECT_TRUE(absl::IsNotFound(status));
    EXPECT_EQ(std::string(status.message()), "There is no uploaded problem of that name.");
    EXPECT_TRUE(absl::IsInvalidArgument(Add(problems_, "ada", id).status()));
  }
}

}  // namespace
}  // namespace dlcs::jobs::testing
