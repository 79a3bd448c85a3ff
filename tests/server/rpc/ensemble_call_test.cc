// SPDX-License-Identifier: Apache-2.0
// SolveEnsemble through a real socket.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "server/session/ensemble_session.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"
#include "tests/server/service_fixture.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using EnsembleCallTest = testing::ServiceTest;

struct EnsembleOutcome {
  std::vector<v1::EnsembleEvent> events;
  grpc::Status status;
  const v1::EnsembleSummary& summary() const { return events.back().summary(); }
};

EnsembleOutcome SolveAll(v1::SolverService::Stub& stub, const v1::SolveEnsembleRequest& request,
                         milliseconds timeout = seconds(60)) {
  grpc::ClientContext context;
  testing::SetDeadline(context, timeout);
  const auto reader = stub.SolveEnsemble(&context, request);
  EnsembleOutcome outcome;
  for (v1::EnsembleEvent event; reader->Read(&event);) outcome.events.push_back(event);
  outcome.status = reader->Finish();
  return outcome;
}

// `members` initial states of the switching problem.
v1::SolveEnsembleRequest Starts(int members, std::int64_t steps) {
  const v1::SolveRequest one = testing::SteppingRequest(steps);
  v1::SolveEnsembleRequest request;
  *request.mutable_problem() = one.problem();
  *request.mutable_options() = one.options();
  for (int k = 0; k < members; ++k) request.add_members()->add_x0(0.1 * k);
  return request;
}

// The x of each member, and whether the events arrived in one of the promised orders.
std::map<std::int64_t, std::vector<double>> StatesOf(const std::vector<v1::EnsembleEvent>& events) {
  std::map<std::int64_t, std::vector<double>> states;
  std::int64_t current = -1;
  for (std::size_t k = 0; k < events.size(); ++k) {
    const v1::EnsembleEvent& event = events[k];
    EXPECT_EQ(event.sequence(), static_cast<std::int64_t>(k) + 1);
    EXPECT_EQ(event.has_accepted(), k == 0);
    EXPECT_EQ(event.has_summary(), k + 1 == events.size());
    if (event.has_trajectory()) {
      if (current < 0) current = event.trajectory().member();
      EXPECT_EQ(event.trajectory().member(), current);
      const auto& x = event.trajectory().chunk().x();
      states[current].insert(states[current].end(), x.begin(), x.end());
    }
    if (event.has_member()) {
      EXPECT_TRUE(current < 0 || event.member().member() == current);
      states[event.member().member()];
      current = -1;
    }
  }
  return states;
}

TEST_F(EnsembleCallTest, OutputsHaveTheParametersOfTheirMember) {
  v1::SolveEnsembleRequest request = Starts(3, 50);
  v1::Problem& problem = *request.mutable_problem();
  v1::Parameter& parameter = *problem.add_parameters();
  parameter.set_name("gain");
  parameter.set_value(1);
  problem.mutable_outputs()->add_names("ramp");
  problem.mutable_outputs()->mutable_h()->add_pieces()->mutable_formulas()->add_formulas("gain*t");
  *request.mutable_members(1)->add_parameters() = parameter;
  request.mutable_members(1)->mutable_parameters(0)->set_value(3);
  const EnsembleOutcome outcome = SolveAll(*stub_, request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.events[0].accepted().output_names(0), "ramp");
  int seen = 0;
  for (const v1::EnsembleEvent& event : outcome.events) {
    const v1::TrajectoryChunk& chunk = event.trajectory().chunk();
    ASSERT_EQ(chunk.outputs_size(), chunk.times_size());
    for (int k = 0; k < chunk.times_size(); ++k, ++seen) {
      EXPECT_DOUBLE_EQ(chunk.outputs(k), (event.trajectory().member() == 1 ? 3 : 1) * chunk.times(k));
    }
  }
  EXPECT_GE(seen, 150);
}

TEST_F(EnsembleCallTest, EveryMemberHasTheBitsOfItsOwnSolve) {
  v1::SolveEnsembleRequest request = Starts(12, 500);
  request.mutable_members(3)->set_horizon(4);
  request.mutable_members(3)->set_label("short");
  request.mutable_members(4)->mutable_f()->add_pieces()->mutable_formulas()->add_formulas("cos(t)");
  request.mutable_members(5)->mutable_break_points()->add_times(1.25);
  request.mutable_members(6)->clear_x0();
  const EnsembleOutcome outcome = SolveAll(*stub_, request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const auto states = StatesOf(outcome.events);
  ASSERT_EQ(states.size(), 12U);
  EXPECT_EQ(outcome.summary().solved() + outcome.summary().reached(), 12);
  EXPECT_GT(outcome.summary().setup_hits(), 0);
  for (const auto& [k, x] : states) {
    const v1::EnsembleMember& member = request.members(static_cast<int>(k));
    v1::SolveRequest one;
    *one.mutable_problem() = request.problem();
    *one.mutable_options() = request.options();
    v1::Problem& problem = *one.mutable_problem();
    if (!member.x0().empty()) *problem.mutable_x0() = member.x0();
    if (member.has_f()) *problem.mutable_f() = member.f();
    if (member.has_horizon()) problem.set_horizon(member.horizon());
    if (member.has_break_points()) *problem.mutable_break_points() = member.break_points().times();
    std::vector<double> own;
    for (const v1::SolveEvent& event : testing::Solve(*stub_, one).events) {
      own.insert(own.end(), event.trajectory().x().begin(), event.trajectory().x().end());
    }
    EXPECT_EQ(x, own) << k;
  }
  for (const v1::EnsembleEvent& event : outcome.events) {
    if (!event.has_member()) continue;
    EXPECT_EQ(event.member().label(), event.member().member() == 3 ? "short" : "");
  }
}

TEST_F(EnsembleCallTest, NamesEveryMistakeAndSolvesNothing) {
  v1::SolveEnsembleRequest request = Starts(4, 100);
  request.mutable_members(1)->add_x0(2);
  request.mutable_members(2)->set_horizon(-1);
  request.mutable_members(3)->mutable_f()->add_pieces()->mutable_formulas()->add_formulas("sin(");
  const EnsembleOutcome outcome = SolveAll(*stub_, request);
  EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(outcome.events.empty());
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(FromGrpc(outcome.status))) fields.push_back(violation.field);
  EXPECT_THAT(fields, ::testing::ElementsAre("members[1].x0", "members[2].horizon", HasSubstr("members[3].f")));

  request = Starts(2, 100);
  request.mutable_members(1)->mutable_g()->add_pieces();
  EXPECT_THAT(SolveAll(*stub_, request).status.error_message(), HasSubstr("members[1].g.pieces[0]"));
  EXPECT_EQ(SolveAll(*stub_, Starts(0, 100)).status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(EnsembleCallTest, RefusesWhatIsAboveALimit) {
  ServerConfig config;
  config.max_members = 3;
  config.max_states = 5;
  StartServer(config);
  EXPECT_THAT(SolveAll(*stub_, Starts(4, 100)).status.error_message(), HasSubstr("max_members"));
  v1::SolveEnsembleRequest request = Starts(1, 100);
  auto& lift = *request.mutable_members(0)->mutable_f()->mutable_lift()->mutable_sparse();
  lift.set_rows(1);
  lift.set_columns(2'000'000'000);  // a few bytes that would need gigabytes
  EXPECT_THAT(SolveAll(*stub_, request).status.error_message(), HasSubstr("max_states"));
  EXPECT_TRUE(SolveAll(*stub_, Starts(3, 100)).status.ok());
}

TEST_F(EnsembleCallTest, ASlowReaderHoldsMembersBackAndTheServersMemoryStaysFlat) {
  ServerConfig config;
  config.threads = 1;
  config.max_result_bytes = 4'000'000;  // of the 12 members of 2.4 MB each, one is held at a time
  config.max_held_result_bytes = 4'000'000;
  StartServer(config);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(60));
  const auto reader = stub_->SolveEnsemble(&context, Starts(12, 100'000));
  ASSERT_TRUE(WaitForSolves(1));
  std::this_thread::sleep_for(milliseconds(400));  // long enough for all, if nothing held them back
  EXPECT_EQ(server_->solves(), 1);
  std::vector<v1::EnsembleEvent> events;
  for (v1::EnsembleEvent event; reader->Read(&event);) events.push_back(event);
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(StatesOf(events).size(), 12U);
  EXPECT_EQ(events.back().summary().solved() + events.back().summary().reached(), 12);
}

TEST_F(EnsembleCallTest, NearTheDeadlineWhatFinishedArrivesAndTheRestIsCounted) {
  // A member that has reached T is not stopped while its error is estimated.
  v1::SolveEnsembleRequest request = Starts(1000, 15'000'000 / testing::kSlowness);
  request.mutable_options()->set_estimate_error(false);
  // Little to deliver, however busy the machine.
  request.mutable_options()->add_output_times(request.problem().horizon());
  const EnsembleOutcome outcome = SolveAll(*stub_, request, seconds(2));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const v1::EnsembleSummary& summary = outcome.summary();
  EXPECT_GT(summary.stopped(), 0);
  EXPECT_GT(summary.not_begun(), 0);
  EXPECT_EQ(summary.solved() + summary.reached() + summary.failed() + summary.stopped() + summary.not_begun(), 1000);
  EXPECT_THAT(summary.message(), HasSubstr("deadline"));
  EXPECT_EQ(static_cast<std::int64_t>(StatesOf(outcome.events).size()),
            summary.solved() + summary.reached() + summary.stopped());
}

TEST_F(EnsembleCallTest, CancelEndsTheMembersAlsoWhereTheyWaitForTheReader) {
  ServerConfig config;
  config.max_result_bytes = config.max_held_result_bytes = 50'000'000;
  StartServer(config);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(60));
  const auto reader = stub_->SolveEnsemble(&context, Starts(100, 1'000'000 / testing::kSlowness));
  ASSERT_TRUE(WaitForSolves(1));
  std::this_thread::sleep_for(milliseconds(200));
  context.TryCancel();
  EXPECT_TRUE(WaitForSolves(0));
  EXPECT_TRUE(server_->WaitUntilIdle(seconds(10)));
  v1::EnsembleEvent event;
  while (reader->Read(&event)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(EnsembleCallTest, AMemberWithoutASolutionIsCountedAndTheOthersSolved) {
  v1::SolveEnsembleRequest request = Starts(3, 200);
  *request.mutable_problem()->mutable_m() = testing::DenseMatrix(1, 1, {0});  // N x + g >= 0 cannot be restored by y
  *request.mutable_problem()->mutable_n() = testing::DenseMatrix(1, 1, {0});
  request.mutable_problem()->mutable_g()->mutable_pieces(0)->mutable_formulas()->set_formulas(0, "1");
  request.mutable_members(1)->mutable_g()->add_pieces()->mutable_formulas()->add_formulas("1-t");
  const EnsembleOutcome outcome = SolveAll(*stub_, request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.summary().solved() + outcome.summary().reached(), 2) << outcome.summary().ShortDebugString();
  EXPECT_EQ(outcome.summary().failed(), 1);
}

}  // namespace
}  // namespace dlcs
