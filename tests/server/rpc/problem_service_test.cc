// SPDX-License-Identifier: Apache-2.0
// Uploaded problems behind a real server, called with the real client, and with invalid requests.
#include "server/rpc/problem_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "client/rpc/client.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "proto/wire/content_hash.h"
#include "spdlog/spdlog.h"
#include "tests/server/service_fixture.h"
#include "tests/server/solve_jobs/job_events.h"
#include "tests/server/solve_jobs/job_runs.h"
#include "tests/server/test_requests.h"
#include "tests/support/paths.h"

namespace dlcs {
namespace {

using client::Client;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::SteppingRequest;
using testing::SwitchingRequest;

v1::ProblemBody BodyOf(const v1::SolveRequest& request, const std::string& title = "") {
  v1::ProblemBody body;
  *body.mutable_problem() = request.problem();
  body.set_title(title);
  return body;
}

// 600 states written down entry by entry: 2.9 MB.
v1::ProblemBody LargeBody() {
  constexpr int kStates = 600;
  v1::SolveRequest request = SwitchingRequest(10);
  v1::Problem& problem = *request.mutable_problem();
  v1::DenseMatrix& a = *problem.mutable_a()->mutable_dense();
  a.set_rows(kStates);
  a.set_columns(kStates);
  a.mutable_values()->Resize(kStates * kStates, 0.0);
  for (int k = 0; k < kStates; ++k) a.set_values(k * (kStates + 1), -1 - 0.001 * k);
  for (v1::Matrix* matrix : {problem.mutable_b(), problem.mutable_n()}) {
    v1::DenseMatrix& column = *matrix->mutable_dense();
    matrix == problem.mutable_b() ? column.set_rows(kStates) : column.set_columns(kStates);
    column.mutable_values()->Resize(kStates, 0.0);
    column.set_values(0, 1);
  }
  problem.mutable_f()->Clear();
  problem.mutable_f()->add_pieces()->mutable_constant()->mutable_values()->Resize(kStates, 0.0);
  problem.mutable_x0()->Resize(kStates, 1.0);
  return BodyOf(request);
}

// The machine-readable reason of an error.
std::string LimitOf(const grpc::Status& status) {
  google::rpc::Status details;
  details.ParseFromString(status.error_details());
  for (const auto& detail : details.details()) {
    google::rpc::ErrorInfo info;
    if (detail.UnpackTo(&info)) return info.metadata().at("limit");
  }
  return "";
}

class ProblemServiceTest : public testing::ServiceTest {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    Start();
  }

  void Start(ServerConfig config = {}) {
    config.store = folder_.File("jobs.db");
    config.checkpoint_ms = 20;
    StartServer(config);
    client_ = *Client::Connect(server_->address());
    problems_ = v1::ProblemService::NewStub(testing::Connect(server_->address()));
  }

  std::string Upload(const v1::ProblemBody& body) {
    const auto uploaded = client_->problems().Upload(body, {});
    EXPECT_TRUE(uploaded.ok()) << uploaded.status();
    return uploaded.ok() ? uploaded->problem().name() : "";
  }

  // The status for a client that announces and sends this.
  grpc::Status UploadRaw(std::int64_t announced, const std::string& sha256, const std::vector<std::string>& pieces,
                         v1::UploadProblemResponse* response = nullptr) {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(30));
    v1::UploadProblemResponse ignored;
    const auto writer = problems_->UploadProblem(&context, response != nullptr ? response : &ignored);
    v1::UploadProblemRequest part;
    part.mutable_start()->set_bytes(announced);
    part.mutable_start()->set_sha256(sha256);
    writer->Write(part);
    for (const std::string& piece : pieces) {
      part.set_data(piece);
      writer->Write(part);
    }
    writer->WritesDone();
    return writer->Finish();
  }

  // In one message.
  grpc::Status Create(const v1::ProblemBody& body, v1::StoredProblem* stored) {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(30));
    v1::CreateProblemRequest request;
    *request.mutable_problem() = body.problem();
    request.set_title(body.title());
    return problems_->CreateProblem(&context, request, stored);
  }

  std::size_t CountProblems() {
    const auto problems = client_->problems().List({});
    EXPECT_TRUE(problems.ok()) << problems.status();
    return problems->size();
  }

  jobs::testing::TemporaryFolder folder_;
  std::unique_ptr<Client> client_;
  std::unique_ptr<v1::ProblemService::Stub> problems_;
};

TEST_F(ProblemServiceTest, ANameGivesTheBitsOfTheProblem) {
  const v1::SolveRequest whole = SwitchingRequest(2000);
  const v1::ProblemBody body = BodyOf(whole, "switching");
  const auto uploaded = client_->problems().Upload(body, {});
  ASSERT_TRUE(uploaded.ok()) << uploaded.status();
  EXPECT_FALSE(uploaded->existed());
  const v1::StoredProblem& problem = uploaded->problem();
  EXPECT_THAT(problem.name(), ::testing::MatchesRegex("problems/[0-9a-f]+"));
  EXPECT_EQ(problem.title(), "switching");
  EXPECT_EQ(problem.states(), 1);
  EXPECT_EQ(problem.constraints(), 1);
  EXPECT_EQ(problem.horizon(), 10);
  EXPECT_FALSE(problem.nonlinear());
  EXPECT_EQ(problem.bytes(), static_cast<std::int64_t>(body.ByteSizeLong()));
  EXPECT_GT(problem.expire_time().seconds(), problem.create_time().seconds() + 6 * 24 * 3600);
  EXPECT_EQ(client_->problems().Get(problem.name(), {})->SerializeAsString(), problem.SerializeAsString());

  v1::SolveRequest named;
  named.set_problem_name(problem.name());
  *named.mutable_options() = whole.options();
  const auto backend = *Client::Connect(server_->address());
  const auto result = backend->Solve(named, {}, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const testing::Trajectory expected = testing::SolveHere(whole);
  testing::ExpectSameTrajectory({result->times, result->x, result->y, result->w}, expected);

  v1::CreateSolveJobRequest create;
  *create.mutable_solve() = named;
  const auto job = client_->jobs().Submit(create, {});
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->problem_name(), problem.name());
  v1::WatchSolveJobRequest watch;
  watch.set_name(job->name());
  ASSERT_TRUE(client_->jobs().Watch(watch, [](const v1::SolveEvent&) {}, {.deadline = seconds(60), .stop = {}}).ok());
  testing::ExpectSameTrajectory(testing::ReadAll(client_->jobs(), job->name()), expected);

  v1::AnalyzeProblemRequest analyze;
  analyze.set_problem_name(problem.name());
  const auto analysis = backend->AnalyzeProblem(analyze, {});
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  EXPECT_EQ(analysis->states(), 1);

  v1::SolveEnsembleRequest ensemble;
  ensemble.set_problem_name(problem.name());
  *ensemble.mutable_options() = whole.options();
  ensemble.add_members();
  ensemble.add_members()->add_x0(2);
  EXPECT_EQ(backend->SolveEnsemble(ensemble, {}, {})->reached(), 2);
}

TEST_F(ProblemServiceTest, ASolveMayChangeWhatIsNotTheMatrices) {
  v1::SolveRequest changed = SwitchingRequest(500);
  v1::SolveRequest named;
  named.set_problem_name(Upload(BodyOf(changed)));
  *named.mutable_options() = changed.options();
  named.mutable_overrides()->add_x0(-0.5);
  named.mutable_overrides()->set_horizon(3);
  changed.mutable_problem()->set_x0(0, -0.5);
  changed.mutable_problem()->set_horizon(3);
  const auto backend = *Client::Connect(server_->address());
  const auto result = backend->Solve(named, {}, {});
  ASSERT_TRUE(result.ok()) << result.status();
  testing::ExpectSameTrajectory({result->times, result->x, result->y, result->w}, testing::SolveHere(changed));

  named.mutable_overrides()->add_x0(1);
  EXPECT_THAT(std::string(backend->Solve(named, {}, {}).status().message()), HasSubstr("x0"));
  changed.mutable_overrides()->add_x0(1);
  EXPECT_THAT(std::string(backend->Solve(changed, {}, {}).status().message()),
              HasSubstr("overrides: are allowed with problem_name"));
}

TEST_F(ProblemServiceTest, WhatIsThereNeedNotBeSent) {
  const v1::ProblemBody body = BodyOf(SwitchingRequest(1));
  const std::string name = Upload(body);
  EXPECT_TRUE(client_->problems().Upload(body, {})->existed());
  v1::UploadProblemResponse response;
  const std::string bytes = body.SerializeAsString();
  const grpc::Status status = UploadRaw(static_cast<std::int64_t>(bytes.size()), ContentHash(bytes), {}, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(response.existed());
  EXPECT_EQ(response.problem().name(), name);
  // Far more than the buffers between client and server hold: the server does not read it.
  EXPECT_TRUE(UploadRaw(1, ContentHash(bytes), std::vector<std::string>(64, std::string(512 << 10, 'x'))).ok());
  EXPECT_EQ(CountProblems(), 1u);
}

TEST_F(ProblemServiceTest, InOneMessageItIsTheSameProblem) {
  const v1::ProblemBody body = BodyOf(SwitchingRequest(1), "switching");
  v1::StoredProblem created, again;
  const grpc::Status status = Create(body, &created);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(created.bytes(), static_cast<std::int64_t>(body.ByteSizeLong()));
  EXPECT_EQ(client_->problems().Get(created.name(), {})->SerializeAsString(), created.SerializeAsString());
  const auto uploaded = client_->problems().Upload(body, {});
  ASSERT_TRUE(uploaded.ok());
  EXPECT_TRUE(uploaded->existed());
  EXPECT_EQ(uploaded->problem().name(), created.name());
  EXPECT_TRUE(Create(body, &again).ok());
  EXPECT_EQ(again.name(), created.name());
  EXPECT_EQ(CountProblems(), 1u);
}

TEST_F(ProblemServiceTest, InOneMessageItHasTheSameRulesAndLimits) {
  ServerConfig config;
  config.max_upload_bytes = 3000;
  config.max_uploaded_problems_per_user = 1;
  Start(config);
  v1::StoredProblem ignored;
  v1::ProblemBody wrong = BodyOf(SwitchingRequest(1));
  wrong.mutable_problem()->add_x0(7);
  const grpc::Status unsound = Create(wrong, &ignored);
  EXPECT_EQ(unsound.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(unsound.error_message(), HasSubstr("x0: 2 components"));
  grpc::ClientContext context;
  EXPECT_EQ(problems_->CreateProblem(&context, {}, &ignored).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::ProblemBody large = BodyOf(SwitchingRequest(1));
  large.mutable_problem()->mutable_break_points()->Resize(400, 1);
  EXPECT_EQ(LimitOf(Create(large, &ignored)), "max_upload_bytes");
  EXPECT_TRUE(Create(BodyOf(SwitchingRequest(1), "one"), &ignored).ok());
  EXPECT_EQ(LimitOf(Create(BodyOf(SwitchingRequest(1), "two"), &ignored)), "max_uploaded_problems_per_user");
  EXPECT_EQ(CountProblems(), 1u);
}

TEST_F(ProblemServiceTest, MayBeLargerThanAMessage) {
  ServerConfig config;
  config.max_message_bytes = 1 << 20;
  Start(config);
  const v1::ProblemBody body = LargeBody();
  ASSERT_GT(body.ByteSizeLong(), 2'500'000u);
  v1::SolveRequest named;
  named.set_problem_name(Upload(body));
  named.mutable_options()->set_steps(10);
  named.mutable_options()->add_output_times(10);
  const auto result = (*Client::Connect(server_->address()))->Solve(named, {}, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->summary.termination(), v1::TERMINATION_REACHED_END) << result->summary.message();
  EXPECT_EQ(result->states, 600u);
}

TEST_F(ProblemServiceTest, RefusesWhatIsNotWhatWasAnnouncedAndKeepsNothing) {
  const std::string bytes = BodyOf(SwitchingRequest(1)).SerializeAsString();
  const auto size = static_cast<std::int64_t>(bytes.size());
  const std::string hash = ContentHash(bytes);
  std::string damaged = bytes;
  damaged[bytes.size() / 2] ^= 1;
  const std::string garbage(100, '\xff');
  v1::ProblemBody wrong = BodyOf(SwitchingRequest(1));
  wrong.mutable_problem()->set_horizon(-1);
  wrong.mutable_problem()->add_x0(7);
  const std::string unsound = wrong.SerializeAsString();
  const struct {
    grpc::Status status;
    const char* words;
  } cases[] = {
      {UploadRaw(size, hash, {damaged}), "SHA-256"},
      {UploadRaw(size, hash, {bytes.substr(0, 20)}), "ended after 20 of"},
      {UploadRaw(size, hash, {bytes, "x"}), "goes beyond"},
      {UploadRaw(0, hash, {}), "start.bytes: 0"},
      {UploadRaw(size, "short", {bytes}), "start.sha256: has 5 bytes"},
      {UploadRaw(100, ContentHash(garbage), {garbage}), "not a dlcs.v1.ProblemBody"},
      {UploadRaw(static_cast<std::int64_t>(unsound.size()), ContentHash(unsound), {unsound}), "x0: 2 components"},
  };
  for (const auto& refused : cases) {
    EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << refused.status.error_message();
    EXPECT_THAT(refused.status.error_message(), HasSubstr(refused.words));
  }
  grpc::ClientContext context;
  v1::UploadProblemResponse response;
  const auto writer = problems_->UploadProblem(&context, &response);
  v1::UploadProblemRequest part;
  part.set_data(bytes);
  writer->Write(part);
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT) << "no start";
  EXPECT_EQ(CountProblems(), 0u);
  EXPECT_TRUE(UploadRaw(size, hash, {bytes.substr(0, 7), "", bytes.substr(7)}).ok());
  EXPECT_EQ(CountProblems(), 1u);
}

TEST_F(ProblemServiceTest, ACutUploadLeavesNothingAndTakesNoPlace) {
  const std::string bytes = BodyOf(SwitchingRequest(1)).SerializeAsString();
  for (int k = 0; k < 2 * UploadSlots::kMax; ++k) {
    grpc::ClientContext context;
    v1::UploadProblemResponse response;
    const auto writer = problems_->UploadProblem(&context, &response);
    v1::UploadProblemRequest part;
    part.mutable_start()->set_bytes(static_cast<std::int64_t>(bytes.size()));
    part.mutable_start()->set_sha256(ContentHash(bytes));
    writer->Write(part);
    part.set_data(bytes.substr(0, 10));
    writer->Write(part);
    context.TryCancel();
    EXPECT_FALSE(writer->Finish().ok());
  }
  EXPECT_EQ(CountProblems(), 0u);
  Upload(BodyOf(SwitchingRequest(1)));  // waits until the server has noticed the broken connections
}

TEST_F(ProblemServiceTest, LimitsAreToldAndKept) {
  ServerConfig config;
  config.max_upload_bytes = 10'000;
  config.max_uploaded_bytes_per_user = 2000;
  config.max_uploaded_problems_per_user = 2;
  config.keep_problems_s = 3600;
  Start(config);
  const auto told = (*Client::Connect(server_->address()))->GetCapabilities({});
  ASSERT_TRUE(told.ok());
  EXPECT_EQ(told->uploads().max_upload_bytes(), 10'000);
  EXPECT_EQ(told->uploads().max_uploaded_bytes_per_user(), 2000);
  EXPECT_EQ(told->uploads().max_uploaded_problems_per_user(), 2);
  EXPECT_EQ(told->uploads().keep_unused().seconds(), 3600);

  const grpc::Status large = UploadRaw(10'001, ContentHash("x"), {});
  EXPECT_EQ(large.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(LimitOf(large), "max_upload_bytes");
  v1::ProblemBody body = BodyOf(SwitchingRequest(1));
  body.mutable_problem()->mutable_break_points()->Resize(300, 0.0);
  for (int k = 0; k < 300; ++k) body.mutable_problem()->set_break_points(k, 0.01 * (k + 1));
  const std::string bytes = body.SerializeAsString();
  const grpc::Status full = UploadRaw(static_cast<std::int64_t>(bytes.size()), ContentHash(bytes), {bytes});
  EXPECT_EQ(full.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << full.error_message();
  EXPECT_EQ(LimitOf(full), "max_uploaded_bytes_per_user");
  Upload(BodyOf(SwitchingRequest(1), "one"));
  const std::string second = Upload(BodyOf(SwitchingRequest(1), "two"));
  EXPECT_THAT(std::string(client_->problems().Upload(BodyOf(SwitchingRequest(1), "three"), {}).status().message()),
              HasSubstr("max_uploaded_problems_per_user would be 3, and this server allows 2. Delete problems"));
  ASSERT_TRUE(client_->problems().Delete(second, {}).ok());
  Upload(BodyOf(SwitchingRequest(1), "three"));
}

TEST_F(ProblemServiceTest, AJobHoldsItsProblemOverARestart) {
  const v1::SolveRequest whole = SteppingRequest(2'000'000 / testing::kSlowness);
  v1::CreateSolveJobRequest create;
  create.mutable_solve()->set_problem_name(Upload(BodyOf(whole)));
  *create.mutable_solve()->mutable_options() = whole.options();
  const std::string name = create.solve().problem_name();
  const auto job = client_->jobs().Submit(create, {});
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(client_->problems().Delete(name, {}).code(), absl::StatusCode::kFailedPrecondition);
  server_->Stop(seconds(1));
  Start();
  v1::WatchSolveJobRequest watch;
  watch.set_name(job->name());
  ASSERT_TRUE(client_->jobs().Watch(watch, [](const v1::SolveEvent&) {}, {.deadline = seconds(120), .stop = {}}).ok());
  testing::ExpectSameTrajectory(testing::ReadAll(client_->jobs(), job->name()), testing::SolveHere(whole));
  EXPECT_TRUE(client_->problems().Delete(name, {}).ok());
  EXPECT_EQ(client_->jobs().Submit(create, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(client_->jobs().Get(job->name(), {}).ok());
}

TEST_F(ProblemServiceTest, WhatIsNoNameIsRefusedWithWhatItWas) {
  for (const std::string name : {"", "problems/", "jobs/abc", "problems/../../etc/passwd", "problems/\x01"}) {
    const absl::Status status = client_->problems().Get(name, {}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << name;
    EXPECT_THAT(std::string(status.message()), HasSubstr("must be problems/ and 64 characters"));
  }
  EXPECT_THAT(std::string(client_->problems().Get("problems/\x01", {}).status().message()),
              HasSubstr("\"problems/\\x01\""));
  const std::string unknown = "problems/" + std::string(64, 'a');
  EXPECT_EQ(client_->problems().Get(unknown, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(client_->problems().Delete(unknown, {}).code(), absl::StatusCode::kNotFound);
  v1::SolveRequest named;
  named.set_problem_name(unknown);
  EXPECT_EQ(testing::Solve(*stub_, named).status.error_code(), grpc::StatusCode::NOT_FOUND);
  named.set_problem_name("mine");
  const grpc::Status status = testing::Solve(*stub_, named).status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("problem_name: \"mine\""));
}

TEST_F(ProblemServiceTest, WithoutAStoreNothingIsUploaded) {
  StartServer(ServerConfig());
  EXPECT_EQ((*Client::Connect(server_->address()))->problems().Upload(BodyOf(SwitchingRequest(1)), {}).status().code(),
            absl::StatusCode::kUnimplemented);
  v1::SolveRequest named;
  named.set_problem_name("problems/" + std::string(64, 'a'));
  const grpc::Status status = testing::Solve(*stub_, named).status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("dlcsd --store"));
}

TEST_F(ProblemServiceTest, AnEarlierProgramsJobsGoOn) {
  server_.reset();
  std::filesystem::copy_file(testing::ProjectPath("tests/server/store/version-1.db"), folder_.File("jobs.db"),
                             std::filesystem::copy_options::overwrite_existing);
  for (const char* log : {"jobs.db-wal", "jobs.db-shm"}) std::filesystem::remove(folder_.File(log));
  Start();
  const auto jobs = client_->jobs().List({}, 10, {});
  ASSERT_TRUE(jobs.ok()) << jobs.status();
  ASSERT_EQ(jobs->size(), 3u);
  for (const v1::SolveJob& job : *jobs) {
    v1::WatchSolveJobRequest watch;
    watch.set_name(job.name());
    std::vector<v1::SolveEvent> events;
    const absl::Status watched = client_->jobs().Watch(
        watch, [&](const v1::SolveEvent& event) { events.push_back(event); }, {.deadline = seconds(120), .stop = {}});
    ASSERT_TRUE(watched.ok()) << watched;
    EXPECT_EQ(testing::WhatIsWrongWithJobEvents(events), "");
    EXPECT_EQ(client_->jobs().Get(job.name(), {})->summary().termination(), v1::TERMINATION_REACHED_END);
    EXPECT_GT(testing::ReadAll(client_->jobs(), job.name()).times.size(), 9u);
  }
}

}  // namespace
}  // namespace dlcs
