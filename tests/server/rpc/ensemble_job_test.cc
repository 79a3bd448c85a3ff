// SPDX-License-Identifier: Apache-2.0
// Ensembles as jobs behind a real server, called with the real client.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/client.h"
#include "server/store/clock.h"
#include "spdlog/spdlog.h"
#include "tests/server/service_fixture.h"
#include "tests/server/solve_jobs/ensemble_runs.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::AddShard;
using testing::EnsembleRows;
using ::testing::HasSubstr;
using testing::SwitchingEnsemble;

class EnsembleJobTest : public testing::ServiceTest {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    Start();
  }
  void Start(ServerConfig config = {}) {
    config.store = folder_.File("jobs.db");
    StartServer(config);
    client_ = *client::Client::Connect(server_->address());
  }
  client::JobClient& jobs() { return client_->jobs(); }

  v1::SolveJob Submit(const v1::CreateEnsembleJobRequest& request) {
    const auto job = jobs().SubmitEnsemble(request, {});
    EXPECT_TRUE(job.ok()) << job.status();
    return job.value_or(v1::SolveJob());
  }
  v1::SolveJob Get(const std::string& name) { return jobs().Get(name, {}).value_or(v1::SolveJob()); }

  std::vector<v1::EnsembleShard> Read(const std::string& name, bool follow) {
    v1::ReadEnsembleRequest request;
    request.set_name(name);
    request.set_follow(follow);
    std::vector<v1::EnsembleShard> shards;
    const absl::Status read =
        jobs().ReadEnsemble(request, [&](const v1::EnsembleShard& shard) { shards.push_back(shard); },
                            {.deadline = seconds(120), .stop = {}});
    EXPECT_TRUE(read.ok()) << read;
    return shards;
  }
  static EnsembleRows RowsOf(const std::vector<v1::EnsembleShard>& shards) {
    EnsembleRows rows;
    for (const v1::EnsembleShard& shard : shards) AddShard(shard, rows);
    return rows;
  }

  // The empty one, and one for each shard.
  std::vector<std::string> TokensOf(const std::string& name) {
    grpc::ClientContext context;
    v1::ReadEnsembleRequest request;
    request.set_name(name);
    const auto stub = v1::JobService::NewStub(testing::Connect(server_->address()));
    const auto reader = stub->ReadEnsemble(&context, request);
    std::vector<std::string> tokens = {""};
    for (v1::EnsemblePage page; reader->Read(&page);) {
      if (page.has_shard()) tokens.push_back(page.resume_token());
    }
    EXPECT_TRUE(reader->Finish().ok());
    return tokens;
  }

  jobs::testing::TemporaryFolder folder_;
  std::unique_ptr<client::Client> client_;
};

TEST_F(EnsembleJobTest, EveryMemberComesOnceWithTheBitsOfTheEngine) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(40, 200, 7);
  request.set_title("forty");
  const v1::SolveJob job = Submit(request);
  EXPECT_EQ(job.state(), v1::JOB_STATE_RUNNING);
  EXPECT_EQ(job.ensemble().members(), 40);
  EXPECT_EQ(job.ensemble().shards(), 6);
  const EnsembleRows followed = RowsOf(Read(job.name(), true));
  request.mutable_ensemble()->mutable_options()->add_output_times(request.ensemble().problem().horizon());
  testing::ExpectSameRows(followed, testing::SolveEnsembleHere(request.ensemble()));
  testing::ExpectSameRows(RowsOf(Read(job.name(), false)), followed);

  const v1::SolveJob ended = Get(job.name());
  EXPECT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(ended.title(), "forty");
  EXPECT_EQ(ended.progress(), 1);
  EXPECT_EQ(ended.ensemble().shards_done(), 6);
  EXPECT_EQ(ended.ensemble().counts().solved() + ended.ensemble().counts().reached(), 40);
  ASSERT_EQ(ended.ensemble().columns_size(), 5);
  EXPECT_EQ(ended.ensemble().columns(4).quantity(), v1::EnsembleColumn::QUANTITY_W);
  EXPECT_EQ(jobs().List({}, 10, {})->front().ensemble().columns_size(), 0);
  EXPECT_TRUE(jobs().Delete(job.name(), {}).ok());
}

TEST_F(EnsembleJobTest, AReaderResumesAfterAnyPage) {
  const v1::SolveJob job = Submit(SwitchingEnsemble(30, 50, 5));
  const std::vector<v1::EnsembleShard> all = Read(job.name(), true);
  ASSERT_EQ(all.size(), 6u);
  const std::vector<std::string> tokens = TokensOf(job.name());
  ASSERT_EQ(tokens.size(), 7u);
  for (std::size_t from = 0; from <= all.size(); ++from) {
    grpc::ClientContext context;
    v1::ReadEnsembleRequest request;
    request.set_name(job.name());
    request.set_resume_token(tokens[from]);
    const auto stub = v1::JobService::NewStub(testing::Connect(server_->address()));
    const auto reader = stub->ReadEnsemble(&context, request);
    std::size_t next = from;
    bool complete = false;
    for (v1::EnsemblePage page; reader->Read(&page);) {
      complete = page.complete();
      if (!page.has_shard()) continue;
      ASSERT_LT(next, all.size());
      EXPECT_EQ(page.shard().SerializeAsString(), all[next++].SerializeAsString());
    }
    EXPECT_TRUE(reader->Finish().ok());
    EXPECT_EQ(next, all.size());
    EXPECT_TRUE(complete);
  }
}

TEST_F(EnsembleJobTest, TheEventsCountMembers) {
  const v1::SolveJob job = Submit(SwitchingEnsemble(10, 50, 4));
  v1::WatchSolveJobRequest request;
  request.set_name(job.name());
  std::vector<int> members;
  bool ended = false;
  const absl::Status watched = jobs().Watch(request,
                                            [&](const v1::SolveEvent& event) {
                                              if (event.has_checkpointed())
                                                members.push_back(event.checkpointed().times());
                                              ended = event.has_summary();
                                            },
                                            {.deadline = seconds(60), .stop = {}});
  EXPECT_TRUE(watched.ok()) << watched;
  EXPECT_TRUE(ended);
  ASSERT_EQ(members.size(), 3u);
  EXPECT_TRUE(std::ranges::is_sorted(members));
  EXPECT_EQ(members.back(), 10);
}

TEST_F(EnsembleJobTest, AMemberWithoutASolutionIsAResult) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(20, 50, 5);
  // x' = 100 x: beyond all numbers at T = 10, where one member ends.
  v1::Problem& problem = *request.mutable_ensemble()->mutable_problem();
  *problem.mutable_a() = testing::DenseMatrix(1, 1, {100});
  *problem.mutable_b() = testing::DenseMatrix(1, 1, {0});
  problem.set_horizon(1);
  request.mutable_ensemble()->mutable_members(7)->set_horizon(10);
  const v1::SolveJob job = Submit(request);
  const std::vector<v1::EnsembleShard> shards = Read(job.name(), true);
  const v1::SolveJob ended = Get(job.name());
  EXPECT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(ended.ensemble().counts().failed(), 1);
  const auto shard = std::ranges::find_if(shards, [](const auto& one) { return one.first_member() == 5; });
  ASSERT_NE(shard, shards.end());
  EXPECT_EQ(shard->outcomes(2), v1::MEMBER_OUTCOME_FAILED);
  ASSERT_EQ(shard->failures_size(), 1);
  EXPECT_EQ(shard->failures(0).member(), 7);
  EXPECT_NE(shard->failures(0).message(), "");
}

TEST_F(EnsembleJobTest, ChosenComponentsAndExtremaAreKept) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(6, 100, 4);
  request.mutable_results()->set_extrema(true);
  request.mutable_results()->set_omit_y(true);
  request.mutable_results()->add_x_components(0);
  const v1::SolveJob job = Submit(request);
  const EnsembleRows rows = RowsOf(Read(job.name(), true));
  // t, error; x, min, max; w, min, max.
  ASSERT_EQ(rows.size(), 6u);
  const v1::SolveRequest solve = [&] {
    v1::SolveRequest one = testing::SwitchingRequest(100);
    *one.mutable_problem()->mutable_x0() = request.ensemble().members(3).x0();
    return one;
  }();
  const testing::Outcome outcome = testing::Solve(*stub_, solve);
  std::vector<double> x, w;
  for (const v1::SolveEvent& event : outcome.events) {
    if (!event.has_trajectory()) continue;
    x.insert(x.end(), event.trajectory().x().begin(), event.trajectory().x().end());
    w.insert(w.end(), event.trajectory().w().begin(), event.trajectory().w().end());
  }
  const std::vector<double>& row = rows.at(3);
  ASSERT_EQ(row.size(), 8u);
  EXPECT_EQ(row[2], x.back());
  EXPECT_EQ(row[3], *std::ranges::min_element(x));
  EXPECT_EQ(row[4], *std::ranges::max_element(x));
  EXPECT_EQ(row[7], *std::ranges::max_element(w));
}

TEST_F(EnsembleJobTest, OutputTimesDoNotMoveTheEnd) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(3, 100, 0);
  const double horizon = request.ensemble().problem().horizon();
  request.mutable_ensemble()->mutable_options()->add_output_times(horizon / 4);
  v1::SolveEnsembleRequest with_end = request.ensemble();
  with_end.mutable_options()->add_output_times(horizon);
  const EnsembleRows expected = testing::SolveEnsembleHere(with_end);
  testing::ExpectSameRows(RowsOf(Read(Submit(request).name(), true)), expected);
  request.mutable_results()->set_extrema(true);
  for (const auto& [member, row] : RowsOf(Read(Submit(request).name(), true))) {
    EXPECT_EQ(row[0], horizon);
    EXPECT_EQ(row[2], expected.at(member)[2]);
    EXPECT_LE(row[3], row[2]);
    EXPECT_GE(row[4], row[2]);
  }
}

TEST_F(EnsembleJobTest, WhatIsWrongIsNamedBeforeAnythingIsStored) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(12'000, 50, 0);
  request.mutable_ensemble()->mutable_members(11'003)->add_x0(7);
  const auto job = jobs().SubmitEnsemble(request, {});
  EXPECT_EQ(job.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(job.status().message()), HasSubstr("ensemble.members[11003].x0"));

  request = SwitchingEnsemble(3, 50, 0);
  request.mutable_results()->add_x_components(1);
  EXPECT_THAT(std::string(jobs().SubmitEnsemble(request, {}).status().message()), HasSubstr("results.x_components[0]"));
  request.mutable_results()->set_x_components(0, 0);
  request.mutable_results()->add_x_components(0);
  EXPECT_THAT(std::string(jobs().SubmitEnsemble(request, {}).status().message()), HasSubstr("results.x_components[1]"));
  request.mutable_results()->clear_x_components();
  request.mutable_results()->add_x_components(0);
  request.mutable_results()->set_omit_x(true);
  EXPECT_THAT(std::string(jobs().SubmitEnsemble(request, {}).status().message()), HasSubstr("results.x_components"));
  request = SwitchingEnsemble(3, 50, 0);
  request.mutable_ensemble()->mutable_members(1)->set_horizon(0.5);
  request.mutable_ensemble()->mutable_options()->add_output_times(0.25);
  EXPECT_THAT(std::string(jobs().SubmitEnsemble(request, {}).status().message()),
              HasSubstr("ensemble.options.output_times"));
  request = SwitchingEnsemble(0, 50, 0);
  EXPECT_EQ(jobs().SubmitEnsemble(request, {}).status().code(), absl::StatusCode::kInvalidArgument);
  request = SwitchingEnsemble(3, 50, -1);
  EXPECT_THAT(std::string(jobs().SubmitEnsemble(request, {}).status().message()), HasSubstr("shard_members"));
  EXPECT_TRUE(jobs().List({}, 10, {})->empty());
}

TEST_F(EnsembleJobTest, LimitsAreNamed) {
  ServerConfig config;
  config.max_result_bytes = 10'000;
  Start(config);
  // 41 bytes each, and one time of a solve.
  const auto job = jobs().SubmitEnsemble(SwitchingEnsemble(300, 50, 0), {});
  EXPECT_EQ(job.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(job.status().message()), HasSubstr("max_result_bytes"));
}

TEST_F(EnsembleJobTest, TheSameRequestIsOneJobAndNothingIsStoredToValidate) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(5, 50, 0);
  request.set_validate_only(true);
  const v1::SolveJob checked = Submit(request);
  EXPECT_EQ(checked.name(), "");
  EXPECT_GT(checked.predicted_core_seconds(), 0);
  EXPECT_TRUE(jobs().List({}, 10, {})->empty());
  request.set_validate_only(false);
  request.set_request_id("one");
  EXPECT_EQ(Submit(request).name(), Submit(request).name());
  request.mutable_ensemble()->mutable_members(4)->set_x0(0, 77);
  EXPECT_EQ(jobs().SubmitEnsemble(request, {}).status().code(), absl::StatusCode::kAlreadyExists);
}

// A thousand solves by the default method, of a system of one state and one pair, take half a second.
TEST_F(EnsembleJobTest, ManySmallSolvesArePredictedToBeShort) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(1000, 50, 0);
  request.mutable_ensemble()->clear_options();
  request.set_validate_only(true);
  const double predicted = Submit(request).predicted_core_seconds();
  EXPECT_GT(predicted, 0.2);
  EXPECT_LT(predicted, 5);
}

TEST_F(EnsembleJobTest, ACancelledEnsembleKeepsWhatIsStored) {
  const v1::SolveJob job = Submit(SwitchingEnsemble(2000, 3000, 2));
  while (Get(job.name()).ensemble().shards_done() == 0) std::this_thread::sleep_for(milliseconds(5));
  const auto cancelled = jobs().Cancel(job.name(), {});
  ASSERT_TRUE(cancelled.ok()) << cancelled.status();
  EXPECT_EQ(cancelled->state(), v1::JOB_STATE_CANCELLED);
  const std::vector<v1::EnsembleShard> shards = Read(job.name(), true);  // ends, since the job has
  EXPECT_FALSE(shards.empty());
  EXPECT_EQ(static_cast<int>(shards.size()), Get(job.name()).ensemble().shards_done());
}

TEST_F(EnsembleJobTest, ADeadlineEndsTheWholeAndKeepsWhatIsStored) {
  v1::CreateEnsembleJobRequest request = SwitchingEnsemble(20'000, 3000, 20);
  const std::int64_t deadline_s =
      std::chrono::ceil<seconds>(jobs::SystemClock().Now()).time_since_epoch() / seconds(1) + 1;
  request.mutable_deadline()->set_seconds(deadline_s);
  const v1::SolveJob job = Submit(request);
  const std::vector<v1::EnsembleShard> shards = Read(job.name(), true);  // ends with the job
  const v1::SolveJob ended = Get(job.name());
  EXPECT_EQ(ended.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(ended.error().code(), static_cast<int>(absl::StatusCode::kDeadlineExceeded));
  EXPECT_GE(ended.end_time().seconds(), deadline_s);
  EXPECT_LE(ended.end_time().seconds(), deadline_s + 2);
  EXPECT_FALSE(shards.empty());
  EXPECT_EQ(static_cast<int>(shards.size()), ended.ensemble().shards_done());
  EXPECT_LT(ended.ensemble().shards_done(), ended.ensemble().shards());
}

TEST_F(EnsembleJobTest, AnEnsembleOutlivesItsServer) {
  const v1::CreateEnsembleJobRequest request = SwitchingEnsemble(200, 2000, 5);
  const v1::SolveJob job = Submit(request);
  while (Get(job.name()).ensemble().shards_done() < 2) std::this_thread::sleep_for(milliseconds(5));
  server_.reset();
  Start();
  EXPECT_EQ(RowsOf(Read(job.name(), true)).size(), 200u);
  EXPECT_EQ(Get(job.name()).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(EnsembleJobTest, ReadersAreToldWhichCallReadsWhat) {
  const v1::SolveJob ensemble = Submit(SwitchingEnsemble(2, 50, 0));
  v1::ReadTrajectoryRequest trajectory;
  trajectory.set_name(ensemble.name());
  EXPECT_EQ(jobs().ReadTrajectory(trajectory, [](const auto&) {}, {}).code(), absl::StatusCode::kFailedPrecondition);
  v1::CreateSolveJobRequest create;
  *create.mutable_solve() = testing::SwitchingRequest(50);
  const auto solve = jobs().Submit(create, {});
  ASSERT_TRUE(solve.ok()) << solve.status();
  v1::ReadEnsembleRequest read;
  read.set_name(solve->name());
  EXPECT_EQ(jobs().ReadEnsemble(read, [](const auto&) {}, {}).code(), absl::StatusCode::kFailedPrecondition);
  read.set_name(ensemble.name());
  Read(ensemble.name(), true);
  const v1::SolveJob other = Submit(SwitchingEnsemble(3, 50, 1));
  Read(other.name(), true);
  for (const std::string& token : {std::string("x"), std::string("1"), TokensOf(other.name()).at(1),
                                   TokensOf(ensemble.name()).at(1) + "0x", TokensOf(ensemble.name()).at(1) + "-1"}) {
    read.set_resume_token(token);
    EXPECT_EQ(jobs().ReadEnsemble(read, [](const auto&) {}, {}).code(), absl::StatusCode::kInvalidArgument) << token;
  }
}

}  // namespace
}  // namespace dlcs
