// SPDX-License-Identifier: Apache-2.0
#include "server/session/solve_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "google/protobuf/stubs/logging.h"
#include "server/wire/errors.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

class Collector final : public SolveSink {
 public:
  void Accept(v1::SolveEvent event) override { events.push_back(std::move(event)); }
  std::vector<v1::SolveEvent> events;
};

// Wants every chunk, or those that `wants` says.
class EarlyReader final : public SolveSink {
 public:
  void Accept(v1::SolveEvent event) override { events.push_back(std::move(event)); }
  bool WantsTrajectory() override { return wants(); }
  std::function<bool()> wants = [] { return true; };
  std::vector<v1::SolveEvent> events;
};

std::string BytesOfTrajectory(const std::vector<v1::SolveEvent>& events) {
  v1::TrajectoryChunk whole;
  for (const v1::SolveEvent& event : events) whole.MergeFrom(event.trajectory());
  whole.clear_first();
  return whole.SerializeAsString();
}

std::vector<std::string> ViolatedFields(const absl::Status& status) {
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(status)) fields.push_back(violation.field);
  return fields;
}

TEST(SolveSessionTest, TellsTheWholeStoryInOrder) {
  Collector sink;
  const absl::Status status =
      RunSolveToEnd(testing::SwitchingRequest(500), SessionLimits(), "here", SolveControl(), sink);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(testing::WhatIsWrongWithOrder(sink.events), "");
  EXPECT_EQ(sink.events[0].accepted().solve_id(), "here");
  EXPECT_TRUE(sink.events[1].has_analysis());
  EXPECT_EQ(sink.events.back().summary().termination(), v1::TERMINATION_REACHED_END);
  EXPECT_GT(testing::Count(sink.events, v1::SolveEvent::kIterate), 0);
  EXPECT_EQ(sink.events.back().summary().times(), sink.events[1].analysis().steps() + 1);
}

TEST(SolveSessionTest, EventsTellWhenTheyHappenedToTheMicrosecond) {
  using std::chrono::microseconds;
  using std::chrono::system_clock;
  Collector sink;
  const auto begin = std::chrono::floor<microseconds>(system_clock::now());
  ASSERT_TRUE(RunSolveToEnd(testing::SwitchingRequest(10), SessionLimits(), "here", SolveControl(), sink).ok());
  auto last = begin;
  for (const v1::SolveEvent& event : sink.events) {
    const auto time = std::chrono::sys_seconds(std::chrono::seconds(event.time().seconds())) +
                      microseconds(event.time().nanos() / 1000);
    EXPECT_GE(time, last) << event.sequence();
    last = time;
  }
  EXPECT_LE(last, system_clock::now());
}

TEST(SolveSessionTest, TrajectorySolvesTheProblem) {
  Collector sink;
  ASSERT_TRUE(RunSolveToEnd(testing::SwitchingRequest(2000), SessionLimits(), "here", SolveControl(), sink).ok());
  double worst = 0;
  int nodes = 0;
  for (const v1::SolveEvent& event : sink.events) {
    const v1::TrajectoryChunk& chunk = event.trajectory();
    for (int k = 0; k < chunk.times_size(); ++k, ++nodes) {
      const double w = chunk.x(k) + chunk.y(k) + std::cos(3 * chunk.times(k)) - 0.5;
      worst = std::max(worst, std::abs(std::min(w, chunk.y(k))));
    }
  }
  EXPECT_EQ(nodes, 2001);
  EXPECT_LT(worst, 1e-10);
}

TEST(SolveSessionTest, TellsTheTrajectorySoFarToThoseWhoWantIt) {
  for (const v1::Method method :
       {v1::METHOD_LAPLACE_ITERATION, v1::METHOD_EXPONENTIAL_INTEGRATOR, v1::METHOD_TIME_STEPPING}) {
    v1::SolveRequest request = testing::SwitchingRequest(20'000);
    request.mutable_options()->set_method(method);
    const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request, SessionLimits());
    ASSERT_TRUE(prepared.ok()) << prepared.status();
    const auto run = [&](EarlyReader& sink) {
      absl::StatusOr<FinishedSolve> finished = RunSolve(*prepared, "here", SolveControl(), sink);
      const int early = testing::Count(sink.events, v1::SolveEvent::kTrajectory);
      while (std::optional<v1::SolveEvent> event = finished->NextEvent()) sink.Accept(*std::move(event));
      EXPECT_EQ(testing::WhatIsWrongWithOrder(sink.events), "") << v1::Method_Name(method);
      return early;
    };
    EarlyReader all, some, none;
    int asked = 0;
    some.wants = [&asked] { return ++asked % 10 < 5; };
    none.wants = [] { return false; };
    const int of_all = run(all), of_some = run(some);
    EXPECT_GT(of_some, 0) << v1::Method_Name(method);
    EXPECT_GT(of_all, of_some) << v1::Method_Name(method);
    EXPECT_EQ(run(none), 0);
    const std::string trajectory = BytesOfTrajectory(none.events);
    EXPECT_TRUE(BytesOfTrajectory(all.events) == trajectory) << v1::Method_Name(method);
    EXPECT_TRUE(BytesOfTrajectory(some.events) == trajectory) << v1::Method_Name(method);
  }
}

TEST(SolveSessionTest, NamesEveryViolationOfProblemAndOptions) {
  v1::SolveRequest request = testing::SwitchingRequest(10);
  request.mutable_problem()->mutable_a()->mutable_dense()->set_values(0, NAN);
  request.mutable_problem()->set_horizon(-1);
  request.mutable_options()->set_theta(2);
  const auto prepared = PrepareSolve(request, SessionLimits());
  EXPECT_EQ(prepared.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(ViolatedFields(prepared.status()), IsSupersetOf({"problem.a[0][0]", "problem.horizon", "options.theta"}));
}

TEST(SolveSessionTest, PutsNamesBehindWhatTheyName) {
  v1::SolveRequest request = testing::SwitchingRequest(10);
  request.mutable_problem()->add_state_names("vC");
  request.mutable_problem()->add_pair_names("D1");
  Collector sink;
  ASSERT_TRUE(RunSolveToEnd(request, SessionLimits(), "here", SolveControl(), sink).ok());
  int analyses = 0;
  for (const v1::SolveEvent& event : sink.events) {
    if (!event.has_analysis()) continue;
    ++analyses;
    EXPECT_THAT(event.analysis().state_names(), ElementsAre("vC"));
    EXPECT_THAT(event.analysis().pair_names(), ElementsAre("D1"));
  }
  EXPECT_EQ(analyses, 1);
  request.mutable_problem()->mutable_m()->mutable_dense()->set_values(0, NAN);
  request.mutable_problem()->mutable_x0()->Set(0, NAN);
  EXPECT_THAT(ViolatedFields(PrepareSolve(request, SessionLimits()).status()),
              IsSupersetOf({"problem.m[0][0] (D1, D1)", "problem.x0[0] (vC)"}));
  // 0 <= y, x - 2 + 0 y >= 0 with x(0) = 1: the state would have to jump.
  *request.mutable_problem()->mutable_m() = testing::DenseMatrix(1, 1, {0});
  request.mutable_problem()->mutable_x0()->Set(0, 1);
  request.mutable_problem()->mutable_g()->mutable_pieces(0)->mutable_formulas()->set_formulas(0, "-2");
  request.mutable_options()->set_method(v1::METHOD_EXPONENTIAL_INTEGRATOR);
  Collector jump;
  ASSERT_TRUE(RunSolveToEnd(request, SessionLimits(), "here", SolveControl(), jump).ok());
  EXPECT_EQ(jump.events.back().summary().termination(), v1::TERMINATION_INCONSISTENT_STATE);
  EXPECT_THAT(jump.events.back().summary().message(), HasSubstr("(N x + g)[0] (D1)"));
}

TEST(SolveSessionTest, NamesTheRuleThatTheMatrixDoesNotAdmit) {
  v1::SolveRequest request = testing::SwitchingRequest(10);
  *request.mutable_problem()->mutable_m() = testing::DenseMatrix(1, 1, {-1});
  request.mutable_problem()->set_rule(v1::SOLUTION_RULE_UNIQUE);
  Collector sink;
  const absl::Status status = RunSolveToEnd(request, SessionLimits(), "here", SolveControl(), sink);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(ViolatedFields(status), Contains("problem.rule"));
}

TEST(SolveSessionTest, NamesTheLimit) {
  const v1::SolveRequest request = testing::SwitchingRequest(1000);
  SessionLimits steps;
  steps.max_steps = 999;
  SessionLimits bytes;
  bytes.max_result_bytes = 1001 * 4 * 8 - 1;
  SessionLimits states;
  states.max_states = 0;
  for (const auto& [limits, name] : {std::pair(steps, "max_steps = 1000"), std::pair(bytes, "max_result_bytes = 32032"),
                                     std::pair(states, "max_states = 1")}) {
    const absl::Status status = PrepareSolve(request, limits).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_THAT(std::string(status.message()), HasSubstr(name));
  }
  bytes.max_result_bytes += 1;
  EXPECT_TRUE(PrepareSolve(request, bytes).ok());
}

TEST(SolveSessionTest, CountsTheTrajectoryAtTheTimesAskedFor) {
  v1::SolveRequest request = testing::SwitchingRequest(1'000'000);
  for (const double t : {1.0, 2.5}) request.mutable_options()->add_output_times(t);
  SessionLimits limits;
  limits.max_result_bytes = 2 * 4 * 8;
  const auto prepared = PrepareSolve(request, limits);
  ASSERT_TRUE(prepared.ok()) << prepared.status();
  EXPECT_EQ(prepared->result_bytes, 64);
  limits.max_result_bytes -= 1;
  EXPECT_THAT(std::string(PrepareSolve(request, limits).status().message()), HasSubstr("max_result_bytes = 64"));
}

TEST(SolveSessionTest, CountsTheNodesGiven) {
  v1::SolveRequest request = testing::SwitchingRequest(1000);
  for (const double t : {0.001, 0.01, 0.1}) request.mutable_options()->mutable_grid_times()->add_times(t);
  SessionLimits limits;
  limits.max_steps = 3;
  EXPECT_THAT(std::string(PrepareSolve(request, limits).status().message()), HasSubstr("max_steps = 4"));
  limits.max_steps = 4;
  EXPECT_TRUE(PrepareSolve(request, limits).ok());
  request.mutable_options()->mutable_grid_times()->add_times(0.05);
  EXPECT_THAT(ViolatedFields(PrepareSolve(request, limits).status()), Contains("options.grid_times[3]"));
}

TEST(SolveSessionTest, CountsTheStepsOfALength) {
  v1::SolveRequest request = testing::SwitchingRequest(1);
  request.mutable_options()->set_step(2e-8);
  SessionLimits limits;
  limits.max_steps = 1'000'000;
  const absl::Status status = PrepareSolve(request, limits).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("max_steps = 500000000"));
  request.mutable_options()->set_step(1e-300);
  EXPECT_THAT(ViolatedFields(PrepareSolve(request, limits).status()), Contains("options.step"));
}

// Any bytes lead to a status: requests with one to four random changes to the bytes of a valid one.
TEST(SolveSessionTest, AnyBytesGetAStatus) {
  const std::string sound = testing::SwitchingRequest(100).SerializeAsString();
  SessionLimits limits;
  limits.max_states = limits.max_constraints = 8;
  limits.max_steps = 1000;
  const google::protobuf::LogSilencer quiet;  // about text that is not UTF-8
  std::mt19937 random(20'261'121);
  int parsed = 0;
  int refused = 0;
  for (int attempt = 0; attempt < 20'000; ++attempt) {
    std::string bytes = sound;
    for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    v1::SolveRequest request;
    if (!request.ParseFromString(bytes)) continue;
    ++parsed;
    const absl::Status status = PrepareSolve(request, limits).status();
    if (status.ok()) continue;
    ++refused;
    EXPECT_TRUE(absl::IsInvalidArgument(status) || absl::IsResourceExhausted(status)) << status;
    EXPECT_NE(status.message(), "");
  }
  EXPECT_GT(parsed, 1000);
  EXPECT_GT(refused, 1000);
}

TEST(SolveSessionTest, ThreadsAreCapped) {
  SessionLimits limits;
  limits.max_threads = 3;
  v1::SolveRequest request = testing::SwitchingRequest(10);
  EXPECT_EQ(PrepareSolve(request, limits)->options.num_threads, 3);
  request.mutable_options()->set_threads(2);
  EXPECT_EQ(PrepareSolve(request, limits)->options.num_threads, 2);
}

// Stops the solve as soon as it reports progress.
class StoppingCollector final : public SolveSink {
 public:
  StoppingCollector(SolveControl& control, StopCause cause) : control_(control), cause_(cause) {}
  void Accept(v1::SolveEvent event) override {
    if (event.has_window_finished() && control_.cause() == StopCause::kNone) {
      stopped_at = std::chrono::steady_clock::now();
      control_.Stop(cause_);
    }
    events.push_back(std::move(event));
  }
  std::vector<v1::SolveEvent> events;
  std::chrono::steady_clock::time_point stopped_at;

 private:
  SolveControl& control_;
  StopCause cause_;
};

TEST(SolveSessionTest, TheCauseOfAStopIsTold) {
  for (const auto& [cause, termination, words] :
       {std::tuple(StopCause::kCancelled, v1::TERMINATION_CANCELLED, "caller"),
        std::tuple(StopCause::kDeadline, v1::TERMINATION_DEADLINE, "deadline"),
        std::tuple(StopCause::kShutdown, v1::TERMINATION_CANCELLED, "shutting down")}) {
    SolveControl control;
    StoppingCollector sink(control, cause);
    const absl::Status status =
        RunSolveToEnd(testing::SteppingRequest(10'000'000), SessionLimits(), "here", control, sink);
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_LT(std::chrono::steady_clock::now() - sink.stopped_at, std::chrono::milliseconds(500));
    const v1::Summary& summary = sink.events.back().summary();
    EXPECT_EQ(summary.termination(), termination);
    EXPECT_THAT(summary.message(), HasSubstr(words));
    EXPECT_GT(summary.times(), 1);
    EXPECT_LT(summary.times(), 10'000'000);
    EXPECT_EQ(testing::WhatIsWrongWithOrder(sink.events), "");
  }
}

}  // namespace
}  // namespace dlcs
