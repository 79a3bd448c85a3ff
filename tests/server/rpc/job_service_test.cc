// SPDX-License-Identifier: Apache-2.0
// Jobs behind a real server, called with the real client.
#include "server/rpc/job_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>

#include "client/rpc/client.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "spdlog/spdlog.h"
#include "tests/server/service_fixture.h"
#include "tests/server/solve_jobs/job_events.h"
#include "tests/server/solve_jobs/job_runs.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using client::CallLimits;
using client::Client;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::SteppingRequest;
using testing::SwitchingRequest;

class JobServiceTest : public testing::ServiceTest {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    Start();
  }

  void Start(milliseconds checkpoint_every = milliseconds(20), int threads = 0) {
    ServerConfig config;
    config.threads = threads;
    config.store = folder_.File("jobs.db");
    config.checkpoint_ms = checkpoint_every.count();
    StartServer(config);
    client_ = *Client::Connect(server_->address());
  }

  v1::SolveJob Submit(const v1::SolveRequest& solve, const std::string& request_id = "") {
    v1::CreateSolveJobRequest request;
    *request.mutable_solve() = solve;
    request.set_request_id(request_id);
    const auto job = client_->jobs().Submit(request, {});
    EXPECT_TRUE(job.ok()) << job.status();
    return job.value_or(v1::SolveJob());
  }

  std::vector<v1::SolveEvent> Watch(const std::string& name, std::int64_t after = 0) {
    v1::WatchSolveJobRequest request;
    request.set_name(name);
    request.set_after_sequence(after);
    std::vector<v1::SolveEvent> events;
    const absl::Status status = client_->jobs().Watch(
        request, [&](const v1::SolveEvent& event) { events.push_back(event); }, {.deadline = seconds(60), .stop = {}});
    EXPECT_TRUE(status.ok()) << status;
    return events;
  }

  jobs::testing::TemporaryFolder folder_;
  std::unique_ptr<Client> client_;
};

TEST_F(JobServiceTest, AJobGivesTheBitsOfASolve) {
  for (const v1::SolveRequest& request : {SwitchingRequest(3000), SteppingRequest(100'000)}) {
    const v1::SolveJob job = Submit(request);
    EXPECT_EQ(job.state(), v1::JOB_STATE_QUEUED);
    EXPECT_EQ(testing::WhatIsWrongWithJobEvents(Watch(job.name())), "");
    const auto ended = client_->jobs().Get(job.name(), {});
    ASSERT_TRUE(ended.ok()) << ended.status();
    EXPECT_EQ(ended->state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(ended->summary().termination(), v1::TERMINATION_REACHED_END) << ended->summary().message();
    EXPECT_EQ(ended->progress(), 1);
    testing::ExpectSameTrajectory(testing::ReadAll(client_->jobs(), job.name()), testing::SolveHere(request));
  }
}

TEST_F(JobServiceTest, SameRequestIdIsTheSameJob) {
  const v1::SolveJob first = Submit(SwitchingRequest(100), "morning run");
  EXPECT_EQ(Submit(SwitchingRequest(100), "morning run").name(), first.name());
  EXPECT_NE(Submit(SwitchingRequest(100)).name(), first.name());
  v1::CreateSolveJobRequest other;
  *other.mutable_solve() = SwitchingRequest(101);
  other.set_request_id("morning run");
  EXPECT_EQ(client_->jobs().Submit(other, {}).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(JobServiceTest, ValidateOnlyTakesNothing) {
  v1::CreateSolveJobRequest request;
  *request.mutable_solve() = SwitchingRequest(100);
  request.set_validate_only(true);
  const auto job = client_->jobs().Submit(request, {});
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->name(), "");
  EXPECT_GT(job->predicted_core_seconds(), 0);
  EXPECT_GT(job->predicted_memory_bytes(), 0);
  EXPECT_TRUE(client_->jobs().List({}, 10, {})->empty());
}

TEST_F(JobServiceTest, RefusesWithTheFieldOrTheLimit) {
  v1::CreateSolveJobRequest request;
  *request.mutable_solve() = SwitchingRequest(100);
  request.mutable_solve()->mutable_problem()->set_horizon(-1);
  absl::Status status = client_->jobs().Submit(request, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("solve.problem.horizon:"));

  *request.mutable_solve() = SwitchingRequest(std::int64_t{1} << 29);
  status = client_->jobs().Submit(request, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("max_steps"));

  *request.mutable_solve() = SteppingRequest(10'000'000);
  request.mutable_deadline()->set_seconds(1);  // in 1970
  status = client_->jobs().Submit(request, {.deadline = seconds(5), .stop = {}}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("deadline: passed"));
  request.clear_deadline();
  request.set_title(std::string(257, 'x'));
  EXPECT_THAT(std::string(client_->jobs().Submit(request, {}).status().message()), HasSubstr("title: has 257 bytes"));
  request.clear_title();
  request.set_priority(101);
  EXPECT_EQ(client_->jobs().Submit(request, {}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(JobServiceTest, KnowsNoJobsButItsOwn) {
  for (const std::string name : {"", "jobs/", "jobs/../../etc/passwd", "solve-1", "jobs/ABCDEFGHIJKLMNOPQRSTUVWXYZ"}) {
    EXPECT_EQ(client_->jobs().Get(name, {}).status().code(), absl::StatusCode::kInvalidArgument) << name;
  }
  const std::string unknown = "jobs/abcdefghijklmnopqrstuvwxyz";
  EXPECT_EQ(client_->jobs().Get(unknown, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(client_->jobs().Cancel(unknown, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(client_->jobs().Delete(unknown, {}).code(), absl::StatusCode::kNotFound);
  v1::WatchSolveJobRequest watch;
  watch.set_name(unknown);
  EXPECT_EQ(client_->jobs().Watch(watch, [](const v1::SolveEvent&) {}, {}).code(), absl::StatusCode::kNotFound);
  v1::ReadTrajectoryRequest read;
  read.set_name(unknown);
  EXPECT_EQ(client_->jobs().ReadTrajectory(read, [](const v1::TrajectoryPage&) {}, {}).code(),
            absl::StatusCode::kNotFound);
}

TEST_F(JobServiceTest, CancelKeepsWhatWasFound) {
  const v1::SolveJob job = Submit(SteppingRequest(4'000'000));
  v1::WatchSolveJobRequest request;
  request.set_name(job.name());
  bool cancelled = false;
  std::vector<v1::SolveEvent> events;
  const absl::Status watched =
      client_->jobs().Watch(request,
                            [&](const v1::SolveEvent& event) {
                              events.push_back(event);
                              if (event.has_checkpointed() && !std::exchange(cancelled, true)) {
                                EXPECT_TRUE(client_->jobs().Cancel(job.name(), {}).ok());
                              }
                            },
                            {.deadline = seconds(60), .stop = {}});
  ASSERT_TRUE(watched.ok()) << watched;
  EXPECT_EQ(testing::WhatIsWrongWithJobEvents(events), "");
  const auto ended = client_->jobs().Get(job.name(), {});
  ASSERT_TRUE(ended.ok());
  EXPECT_EQ(ended->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(ended->summary().termination(), v1::TERMINATION_CANCELLED);
  const testing::Trajectory trajectory = testing::ReadAll(client_->jobs(), job.name());
  EXPECT_GT(trajectory.times.size(), 0u);
  EXPECT_EQ(static_cast<std::int64_t>(trajectory.times.size()), ended->summary().times());
  EXPECT_TRUE(client_->jobs().Delete(job.name(), {}).ok());
  EXPECT_EQ(client_->jobs().Get(job.name(), {}).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobServiceTest, ListsByState) {
  const std::string first = Submit(SwitchingRequest(10)).name();
  const std::string second = Submit(SwitchingRequest(11)).name();
  Watch(first);
  Watch(second);
  const auto jobs = client_->jobs().List({v1::JOB_STATE_SUCCEEDED}, 10, {});
  ASSERT_TRUE(jobs.ok());
  ASSERT_EQ(jobs->size(), 2u);
  EXPECT_EQ((*jobs)[0].name(), second);
  // A list contains only the needed part of the summary.
  v1::Summary brief;
  const v1::Summary whole = client_->jobs().Get(second, {})->summary();
  brief.set_termination(whole.termination());
  *brief.mutable_verdict() = whole.verdict();
  EXPECT_EQ((*jobs)[0].summary().SerializeAsString(), brief.SerializeAsString());
  EXPECT_THAT(brief.verdict().text(), HasSubstr("has an error of"));
  EXPECT_TRUE(client_->jobs().List({v1::JOB_STATE_FAILED}, 10, {})->empty());
}

TEST_F(JobServiceTest, WatchingFromANumberGivesTheRest) {
  const v1::SolveJob job = Submit(SwitchingRequest(200));
  const std::vector<v1::SolveEvent> all = Watch(job.name());
  std::vector<v1::SolveEvent> kept;
  for (const v1::SolveEvent& event : Watch(job.name())) kept.push_back(event);
  ASSERT_GT(kept.size(), 3u);
  for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
    const std::vector<v1::SolveEvent> rest = Watch(job.name(), kept[k].sequence());
    ASSERT_FALSE(rest.empty());
    EXPECT_GT(rest.front().sequence(), kept[k].sequence());
    EXPECT_TRUE(rest.back().has_summary());
  }
  v1::WatchSolveJobRequest beyond;
  beyond.set_name(job.name());
  beyond.set_after_sequence(all.back().sequence() + 1'000'000);
  EXPECT_EQ(client_->jobs().Watch(beyond, [](const v1::SolveEvent&) {}, {}).code(), absl::StatusCode::kOutOfRange);
}

TEST_F(JobServiceTest, WatchersSeeTheFunctionOfAnIterate) {
  Start(milliseconds(20), 1);
  // Waits for its turn until both watch.
  const v1::SolveJob before = Submit(SteppingRequest(10'000'000));
  v1::SolveRequest solve = SwitchingRequest(400);
  solve.mutable_options()->set_window_steps(-1);  // the whole horizon
  const v1::SolveJob job = Submit(solve);
  std::atomic<int> watching = 0;
  const auto last_iterate = [&](v1::WatchView view) {
    v1::WatchSolveJobRequest request;
    request.set_name(job.name());
    request.set_view(view);
    if (view == v1::WATCH_VIEW_FULL) request.add_y_components(0);
    v1::Iterate last;
    const absl::Status watched =
        client_->jobs().Watch(request,
                              [&](const v1::SolveEvent& event) {
                                if (event.has_state() && event.state() == v1::JOB_STATE_QUEUED && ++watching == 2) {
                                  EXPECT_TRUE(client_->jobs().Cancel(before.name(), {}).ok());
                                }
                                if (event.has_iterate()) last = event.iterate();
                              },
                              {.deadline = seconds(60), .stop = {}});
    EXPECT_TRUE(watched.ok()) << watched;
    return last;
  };
  v1::Iterate full;
  std::thread other([&] { full = last_iterate(v1::WATCH_VIEW_FULL); });
  const v1::Iterate sampled = last_iterate(v1::WATCH_VIEW_SAMPLED);
  other.join();
  const testing::Trajectory trajectory = testing::ReadAll(client_->jobs(), job.name());
  ASSERT_EQ(trajectory.times.size(), 401u);
  EXPECT_THAT(full.times(), ::testing::ElementsAreArray(trajectory.times));
  EXPECT_THAT(full.y(), ::testing::ElementsAreArray(trajectory.y));
  EXPECT_THAT(full.y_components(), ::testing::ElementsAre(0));
  ASSERT_EQ(sampled.times_size(), 65);
  EXPECT_EQ(sampled.y_size(), 65);
  EXPECT_EQ(sampled.times(64), trajectory.times.back());
  EXPECT_EQ(sampled.y(64), trajectory.y.back());
}

TEST_F(JobServiceTest, RefusesToShowWhatIsNotThere) {
  const v1::SolveJob job = Submit(SwitchingRequest(10));
  Watch(job.name());
  v1::WatchSolveJobRequest request;
  request.set_name(job.name());
  request.set_view(v1::WATCH_VIEW_FULL);
  request.add_y_components(1);
  const absl::Status status = client_->jobs().Watch(request, [](const v1::SolveEvent&) {}, {});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("y_components[0]: 1; must be between 0 and 0"));
}

TEST_F(JobServiceTest, ReadsAPartOfTheTrajectory) {
  const v1::SolveRequest solve = SwitchingRequest(1000);
  const v1::SolveJob job = Submit(solve);
  Watch(job.name());
  const testing::Trajectory all = testing::SolveHere(solve);
  v1::ReadTrajectoryRequest request;
  request.set_name(job.name());
  request.set_begin(2.5);
  request.set_end(7.5);
  request.set_stride(3);
  request.set_omit_y(true);
  request.set_omit_w(true);
  std::vector<double> times, x;
  bool complete = false;
  ASSERT_TRUE(client_->jobs()
                  .ReadTrajectory(request,
                                  [&](const v1::TrajectoryPage& page) {
                                    times.insert(times.end(), page.chunk().times().begin(), page.chunk().times().end());
                                    x.insert(x.end(), page.chunk().x().begin(), page.chunk().x().end());
                                    EXPECT_EQ(page.chunk().y_size(), 0);
                                    EXPECT_EQ(page.chunk().w_size(), 0);
                                    complete = page.complete();
                                  },
                                  {})
                  .ok());
  EXPECT_TRUE(complete);
  std::vector<double> expected_times, expected_x, expected_w;
  for (std::size_t k = 0; k < all.times.size(); k += 3) {
    if (all.times[k] < 2.5 || all.times[k] > 7.5) continue;
    expected_times.push_back(all.times[k]);
    expected_x.push_back(all.x[k]);
    expected_w.push_back(all.w[k]);
  }
  EXPECT_EQ(times, expected_times);
  EXPECT_EQ(x, expected_x);
  request.set_omit_x(true);
  request.set_omit_w(false);
  std::vector<double> w;
  ASSERT_TRUE(client_->jobs()
                  .ReadTrajectory(request,
                                  [&](const v1::TrajectoryPage& page) {
                                    w.insert(w.end(), page.chunk().w().begin(), page.chunk().w().end());
                                    EXPECT_EQ(page.chunk().x_size() + page.chunk().y_size(), 0);
                                  },
                                  {})
                  .ok());
  EXPECT_EQ(w, expected_w);
  request.set_omit_x(false);
  request.add_x_components(1);
  EXPECT_EQ(client_->jobs().ReadTrajectory(request, [](const v1::TrajectoryPage&) {}, {}).code(),
            absl::StatusCode::kInvalidArgument);
  request.clear_x_components();
  request.set_resume_token("next please");
  EXPECT_EQ(client_->jobs().ReadTrajectory(request, [](const v1::TrajectoryPage&) {}, {}).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(JobServiceTest, PagesHoldTheOutputs) {
  v1::SolveRequest solve = SteppingRequest(1000);
  v1::Outputs& outputs = *solve.mutable_problem()->mutable_outputs();
  outputs.add_names("twice");
  outputs.add_names("time");
  v1::DenseMatrix& c = *outputs.mutable_c()->mutable_dense();
  c.set_rows(2);
  c.set_columns(1);
  c.add_values(2);
  c.add_values(0);
  v1::FormulaFunction& h = *outputs.mutable_h()->add_pieces()->mutable_formulas();
  h.add_formulas("0");
  h.add_formulas("t+(t>=5)");
  v1::Measurement& mean = *solve.mutable_problem()->add_measurements();
  mean.set_name("mean");
  mean.set_kind(v1::MEASUREMENT_KIND_AVERAGE);
  mean.add_outputs(1);
  mean.set_end(5);
  const v1::SolveJob job = Submit(solve);
  Watch(job.name());
  v1::ReadTrajectoryRequest request;
  request.set_name(job.name());
  std::size_t read = 0;
  bool jumped = false;
  const auto check = [&](const v1::TrajectoryPage& page) {
    const v1::TrajectoryChunk& chunk = page.chunk();
    ASSERT_EQ(chunk.outputs_size(), 2 * chunk.times_size());
    for (int k = 0; k < chunk.times_size(); ++k, ++read) {
      EXPECT_EQ(chunk.outputs(2 * k), 2 * chunk.x(k));
      EXPECT_EQ(chunk.outputs(2 * k + 1), chunk.times(k) + (chunk.times(k) >= 5 ? 1 : 0));
    }
    for (const v1::LeftLimit& limit : chunk.left_limits()) {
      if (chunk.times(limit.index() - chunk.first()) != 5) continue;
      jumped = true;
      EXPECT_EQ(limit.outputs(1), 5);
    }
  };
  ASSERT_TRUE(client_->jobs().ReadTrajectory(request, check, {}).ok());
  EXPECT_TRUE(jumped);
  EXPECT_GT(read, 1000u);
  request.add_output_components(1);
  const auto second_alone = [](const v1::TrajectoryPage& page) {
    EXPECT_EQ(page.chunk().outputs_size(), page.chunk().times_size());
  };
  EXPECT_TRUE(client_->jobs().ReadTrajectory(request, second_alone, {}).ok());
  request.set_omit_outputs(true);
  const auto none = [](const v1::TrajectoryPage& page) { EXPECT_EQ(page.chunk().outputs_size(), 0); };
  EXPECT_TRUE(client_->jobs().ReadTrajectory(request, none, {}).ok());
  request.set_output_components(0, 2);
  const absl::Status status = client_->jobs().ReadTrajectory(request, none, {});
  EXPECT_THAT(std::string(status.message()), HasSubstr("output_components[0]: 2; must be between 0 and 1"));
  const auto ended = client_->jobs().Get(job.name(), {});
  ASSERT_TRUE(ended.ok());
  ASSERT_EQ(ended->summary().measurements_size(), 1);
  EXPECT_NEAR(ended->summary().measurements(0).value(), 2.5, 1e-12);
}

TEST_F(JobServiceTest, AStoppedServerGivesItsJobsToTheNext) {
  const v1::SolveRequest solve = SteppingRequest(400'000 / testing::kSlowness);
  const v1::SolveJob job = Submit(solve);
  for (int restart = 0; restart < 3; ++restart) {
    for (int k = 0; k < 500; ++k) {
      const auto now = client_->jobs().Get(job.name(), {});
      ASSERT_TRUE(now.ok()) << now.status();
      if (now->progress() > 0.2 * (restart + 1) || now->state() == v1::JOB_STATE_SUCCEEDED) break;
      std::this_thread::sleep_for(milliseconds(5));
    }
    server_->Stop(seconds(1));
    Start();
  }
  EXPECT_EQ(testing::WhatIsWrongWithJobEvents(Watch(job.name())), "");
  testing::ExpectSameTrajectory(testing::ReadAll(client_->jobs(), job.name()), testing::SolveHere(solve));
}

TEST_F(JobServiceTest, WatchersGoOnAtTheNextServer) {
  const v1::SolveJob job = Submit(SteppingRequest(4'000'000));
  const std::string address = server_->address();
  std::vector<v1::SolveEvent> events;
  int notices = 0;
  auto watching = *Client::Connect(address, [&](const std::string&) { ++notices; });
  absl::Status watched;
  std::thread watcher([&] {
    v1::WatchSolveJobRequest request;
    request.set_name(job.name());
    watched = watching->jobs().Watch(request, [&](const v1::SolveEvent& event) { events.push_back(event); },
                                     {.deadline = seconds(60), .stop = {}});
  });
  std::this_thread::sleep_for(milliseconds(200));
  server_.reset();
  ServerConfig config;
  config.store = folder_.File("jobs.db");
  config.listen = address;
  auto next = DlcsServer::Start(config);
  ASSERT_TRUE(next.ok()) << next.status();
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_TRUE(client_->jobs().Cancel(job.name(), {}).ok());
  watcher.join();
  EXPECT_TRUE(watched.ok()) << watched;
  EXPECT_GT(notices, 0);
  EXPECT_EQ(testing::WhatIsWrongWithJobEvents(events), "");
}

TEST_F(JobServiceTest, HealthFollowsTheStore) {
  const auto health = [&] {
    const auto stub = grpc::health::v1::Health::NewStub(testing::Connect(server_->address()));
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(10));
    grpc::health::v1::HealthCheckRequest request;
    request.set_service("dlcs.v1.JobService");
    grpc::health::v1::HealthCheckResponse response;
    const grpc::Status status = stub->Check(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_code() << " " << status.error_message();
    return response.status() == grpc::health::v1::HealthCheckResponse::SERVING;
  };
  const auto becomes = [&](bool serving) {
    for (int k = 0; k < 300; ++k) {
      if (health() == serving) return true;
      std::this_thread::sleep_for(milliseconds(20));
    }
    return false;
  };
  EXPECT_TRUE(becomes(true));
  std::filesystem::rename(folder_.File("jobs.db"), folder_.File("away.db"));
  v1::CreateSolveJobRequest request;
  *request.mutable_solve() = SwitchingRequest(10);
  EXPECT_EQ(client_->jobs().Submit(request, {.deadline = seconds(3), .stop = {}}).status().code(),
            absl::StatusCode::kUnavailable);
  EXPECT_TRUE(becomes(false));
  std::filesystem::rename(folder_.File("away.db"), folder_.File("jobs.db"));
  EXPECT_TRUE(client_->jobs().Submit(request, {.deadline = seconds(20), .stop = {}}).ok());
  EXPECT_TRUE(becomes(true));
}

}  // namespace
}  // namespace dlcs
