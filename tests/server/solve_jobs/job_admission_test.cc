// SPDX-License-Identifier: Apache-2.0
// Requests that a server refuses: every limit, end to end, with the error that a client receives.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <thread>

#include "client/rpc/client.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "spdlog/spdlog.h"
#include "tests/server/service_fixture.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using client::Client;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::SteppingRequest;
using testing::SwitchingRequest;

// It takes some seconds, is predicted to take more, and has a small result.
v1::SolveRequest LongRequest() {
  v1::SolveRequest request = SteppingRequest(15'000'000);
  request.mutable_options()->add_output_times(10);
  return request;
}

struct Told {
  grpc::Status status;
  v1::SolveJob job;
  std::string limit, value, requested;
  std::optional<double> retry_seconds;
};

class JobAdmissionTest : public testing::ServiceTest {
 protected:
  void SetUp() override { spdlog::set_level(spdlog::level::off); }

  void Start(ServerConfig config) {
    config.store = folder_.File("jobs.db");
    config.threads = 1;
    StartServer(config);
    jobs_ = v1::JobService::NewStub(testing::Connect(server_->address()));
    client_ = *Client::Connect(server_->address());
  }

  // Calls once, without retries.
  Told Create(const v1::CreateSolveJobRequest& request) {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(30));
    Told told;
    told.status = jobs_->CreateSolveJob(&context, request, &told.job);
    google::rpc::Status details;
    details.ParseFromString(told.status.error_details());
    for (const auto& detail : details.details()) {
      google::rpc::ErrorInfo info;
      if (detail.UnpackTo(&info) && info.metadata().contains("limit")) {
        told.limit = info.metadata().at("limit");
        told.value = info.metadata().at("value");
        told.requested = info.metadata().at("requested");
      }
      google::rpc::RetryInfo retry;
      if (detail.UnpackTo(&retry)) {
        told.retry_seconds = static_cast<double>(retry.retry_delay().seconds()) + 1e-9 * retry.retry_delay().nanos();
      }
    }
    return told;
  }
  static v1::CreateSolveJobRequest Request(const v1::SolveRequest& solve) {
    v1::CreateSolveJobRequest request;
    *request.mutable_solve() = solve;
    return request;
  }
  Told Create(const v1::SolveRequest& solve) { return Create(Request(solve)); }

  // Submits a long job and waits until it runs.
  void Occupy() {
    const Told told = Create(LongRequest());
    ASSERT_TRUE(told.status.ok()) << told.status.error_message();
    for (int k = 0; k < 1000; ++k) {
      if (client_->jobs().Get(told.job.name(), {})->state() == v1::JOB_STATE_RUNNING) return;
      std::this_thread::sleep_for(milliseconds(5));
    }
    FAIL() << "does not run";
  }

  static void ExpectRefused(const Told& told, const std::string& limit, bool for_now) {
    EXPECT_EQ(told.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << told.status.error_message();
    EXPECT_EQ(told.limit, limit) << told.status.error_message();
    EXPECT_EQ(told.retry_seconds.has_value(), for_now) << told.status.error_message();
    EXPECT_GE(told.retry_seconds.value_or(1), 0.1);
  }

  jobs::testing::TemporaryFolder folder_;
  std::unique_ptr<v1::JobService::Stub> jobs_;
  std::unique_ptr<Client> client_;
};

TEST_F(JobAdmissionTest, WhatIsTooLargeForThisServerIsNeverTaken) {
  ServerConfig config;
  config.max_memory_bytes = config.max_result_bytes = config.max_held_result_bytes = 1'000'000;
  config.max_job_core_seconds = 0.02;
  Start(config);
  // 0.96 MB of result, held twice, and what the engine works with.
  Told told = Create(SteppingRequest(30'000));
  ExpectRefused(told, "max_job_memory_bytes", false);
  EXPECT_EQ(told.value, "2000000");
  told = Create(SteppingRequest(14'000));
  ExpectRefused(told, "max_job_core_seconds", false);
  EXPECT_EQ(told.value, "0.02");
  EXPECT_THAT(told.status.error_message(), HasSubstr("predicted to need max_job_core_seconds = "));
  ExpectRefused(Create(SteppingRequest(100'000)), "max_result_bytes", false);
  EXPECT_TRUE(Create(SteppingRequest(1000)).status.ok());
}

TEST_F(JobAdmissionTest, AFullQueueSaysWhenToComeBack) {
  ServerConfig config;
  config.max_queued_jobs = 2;
  Start(config);
  Occupy();
  EXPECT_TRUE(Create(SwitchingRequest(10)).status.ok());
  v1::CreateSolveJobRequest remembered = Request(SwitchingRequest(11));
  remembered.set_request_id("remembered");
  const Told taken = Create(remembered);
  ASSERT_TRUE(taken.status.ok());
  const Told told = Create(SwitchingRequest(12));
  ExpectRefused(told, "max_queued_jobs", true);
  EXPECT_EQ(told.value, "2");
  EXPECT_EQ(told.requested, "3");
  EXPECT_THAT(told.status.error_message(), HasSubstr("The queue is full: with this job max_queued_jobs would be 3"));
  // A repeated request still returns its job, and a validation returns the same refusal.
  EXPECT_EQ(Create(remembered).job.name(), taken.job.name());
  v1::CreateSolveJobRequest check = Request(SwitchingRequest(12));
  check.set_validate_only(true);
  ExpectRefused(Create(check), "max_queued_jobs", true);
}

TEST_F(JobAdmissionTest, AUserHasAShareOfTheQueue) {
  ServerConfig config;
  config.max_queued_jobs_per_user = 1;
  Start(config);
  Occupy();
  EXPECT_TRUE(Create(SwitchingRequest(10)).status.ok());
  ExpectRefused(Create(SwitchingRequest(12)), "max_queued_jobs_per_user", true);
}

TEST_F(JobAdmissionTest, TheQueueHoldsSoMuchWork) {
  ServerConfig config;
  config.max_queued_core_seconds = 20;
  Start(config);
  Occupy();
  EXPECT_TRUE(Create(LongRequest()).status.ok());  // an empty queue accepts any job that may run
  const Told told = Create(LongRequest());
  ExpectRefused(told, "max_queued_core_seconds", true);
  EXPECT_EQ(told.value, "20");
}

TEST_F(JobAdmissionTest, ADeadlineThatCannotBeMetIsRefusedAtOnce) {
  Start({});
  const auto within = [](const v1::SolveRequest& solve, int allowed_s) {
    v1::CreateSolveJobRequest request = Request(solve);
    request.mutable_deadline()->set_seconds(std::time(nullptr) + allowed_s);
    return request;
  };
  // The job alone takes longer than that: never accepted.
  Told told = Create(within(LongRequest(), 4));
  ExpectRefused(told, "deadline", false);
  EXPECT_THAT(told.status.error_message(), HasSubstr("the deadline leaves"));
  // Short, but behind much work: not now.
  Occupy();
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(Create(LongRequest()).status.ok());
  told = Create(within(SwitchingRequest(10), 5));
  ExpectRefused(told, "deadline", true);
  v1::CreateSolveJobRequest first = within(SwitchingRequest(10), 60);
  first.set_priority(100);
  EXPECT_TRUE(Create(first).status.ok()) << "before one's other jobs";
}

TEST_F(JobAdmissionTest, NamesTheFieldAndTheValue) {
  Start({});
  v1::CreateSolveJobRequest request = Request(SwitchingRequest(10));
  request.set_priority(-101);
  request.set_request_id(std::string(129, 'r'));
  const grpc::Status status = Create(request).status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("request_id: has 129 bytes; at most 128"));
  EXPECT_THAT(status.error_details(), HasSubstr("-101: must be between -100 and 100"));
  EXPECT_THAT(std::string(client_->jobs().Get("jobs/Nonsense!", {}).status().message()),
              HasSubstr("name: \"jobs/Nonsense!\"; must be jobs/ and 26 characters of a-z2-7"));
}

TEST_F(JobAdmissionTest, LimitsAreTold) {
  ServerConfig config;
  config.max_job_core_seconds = 11;
  config.max_queued_jobs = 12;
  config.max_queued_jobs_per_user = 13;
  config.max_queued_core_seconds = 14;
  config.max_job_attempts = 15;
  config.keep_finished_s = 16;
  config.keep_finished_bytes = 17;
  Start(config);
  grpc::ClientContext context;
  v1::GetCapabilitiesResponse told;
  ASSERT_TRUE(stub_->GetCapabilities(&context, {}, &told).ok());
  const v1::JobLimits& limits = told.jobs();
  EXPECT_EQ(limits.max_job_core_seconds(), 11);
  EXPECT_EQ(limits.max_queued_jobs(), 12);
  EXPECT_EQ(limits.max_queued_jobs_per_user(), 13);
  EXPECT_EQ(limits.max_queued_core_seconds(), 14);
  EXPECT_EQ(limits.max_attempts(), 15);
  EXPECT_EQ(limits.keep_finished().seconds(), 16);
  EXPECT_EQ(limits.keep_finished_bytes(), 17);
  EXPECT_EQ(limits.cores(), 1);
  EXPECT_EQ(limits.max_priority(), 100);
  EXPECT_EQ(limits.max_job_memory_bytes(), config.max_memory_bytes + config.max_held_result_bytes);
  EXPECT_EQ(limits.max_watch_interval().seconds(), 3600);
  EXPECT_GT(limits.heartbeat_interval().seconds(), 0);
  EXPECT_LE(limits.heartbeat_interval().seconds(), 15);
  EXPECT_EQ(limits.max_ranks(), 0);  // no launcher
}

TEST_F(JobAdmissionTest, WhatHasEndedIsForgottenInTime) {
  ServerConfig config;
  config.keep_finished_s = 1;
  Start(config);
  const Told told = Create(SwitchingRequest(10));
  ASSERT_TRUE(told.status.ok());
  v1::WatchSolveJobRequest watch;
  watch.set_name(told.job.name());
  ASSERT_TRUE(client_->jobs().Watch(watch, [](const v1::SolveEvent&) {}, {.deadline = seconds(30), .stop = {}}).ok());
  for (int k = 0; k < 600; ++k) {
    const absl::Status status = client_->jobs().Get(told.job.name(), {}).status();
    if (absl::IsNotFound(status)) return;
    ASSERT_TRUE(status.ok()) << status;
    std::this_thread::sleep_for(milliseconds(50));
  }
  FAIL() << "still there after half a minute";
}

}  // namespace
}  // namespace dlcs
