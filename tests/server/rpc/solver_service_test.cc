// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/solver_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"
#include "tests/server/service_fixture.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using testing::Count;
using ::testing::HasSubstr;
using testing::Outcome;
using testing::ServiceTest;
using testing::WhatIsWrongWithOrder;

using SolverServiceTest = ServiceTest;

double SecondsSince(steady_clock::time_point begin) {
  return std::chrono::duration<double>(steady_clock::now() - begin).count();
}

struct Analyzed {
  grpc::Status status;
  v1::AnalyzeProblemResponse response;
};

Analyzed Analyze(v1::SolverService::Stub& stub, const v1::Problem& problem) {
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(60));
  v1::AnalyzeProblemRequest request;
  *request.mutable_problem() = problem;
  Analyzed analyzed;
  analyzed.status = stub.AnalyzeProblem(&context, request, &analyzed.response);
  return analyzed;
}

// The part of a result that must not depend on where a solve ran: everything except identifiers, times, and the
// progress of stepping methods, whose reports depend on the clock.
struct Told {
  std::vector<std::string> words;  // analysis, iterates, summary
  std::vector<double> numbers;     // the trajectory: times, x, y, wherever it was cut into chunks
};

Told WhatIsTold(const std::vector<v1::SolveEvent>& events) {
  Told told;
  v1::TrajectoryChunk whole;
  for (v1::SolveEvent event : events) {
    event.clear_sequence();
    event.clear_time();
    if (event.has_iterate()) event.mutable_iterate()->clear_seconds();
    if (event.has_summary()) {
      v1::Cost& cost = *event.mutable_summary()->mutable_cost();
      cost.clear_seconds_setup();
      cost.clear_seconds_lcp();
      cost.clear_seconds_linear();
      cost.clear_seconds_certificate();
      cost.clear_seconds_total();
      cost.clear_process_peak_bytes();
    }
    if (event.has_analysis() || event.has_iterate() || event.has_summary()) {
      told.words.push_back(event.ShortDebugString());
    }
    whole.MergeFrom(event.trajectory());
  }
  for (const auto* values : {&whole.times(), &whole.x(), &whole.y()}) {
    told.numbers.insert(told.numbers.end(), values->begin(), values->end());
  }
  return told;
}

class Collector final : public SolveSink {
 public:
  void Accept(v1::SolveEvent event) override { events.push_back(std::move(event)); }
  std::vector<v1::SolveEvent> events;
};

TEST_F(SolverServiceTest, SolveDeliversAllEventsInOrder) {
  const Outcome outcome = testing::Solve(*stub_, testing::SwitchingRequest(1000));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(WhatIsWrongWithOrder(outcome.events), "");
  EXPECT_EQ(outcome.events.back().summary().termination(), v1::TERMINATION_REACHED_END);
  EXPECT_TRUE(outcome.events[1].has_analysis());
  EXPECT_GT(Count(outcome.events, v1::SolveEvent::kIterate), 0);
  EXPECT_EQ(Count(outcome.events, v1::SolveEvent::kWindowStarted),
            Count(outcome.events, v1::SolveEvent::kWindowFinished));
}

TEST_F(SolverServiceTest, InProcessAndThroughTheServerAreTheSameBits) {
  for (const v1::Method method :
       {v1::METHOD_LAPLACE_ITERATION, v1::METHOD_EXPONENTIAL_INTEGRATOR, v1::METHOD_TIME_STEPPING}) {
    v1::SolveRequest request = testing::SwitchingRequest(3000);
    request.mutable_options()->set_method(method);
    const Outcome there = testing::Solve(*stub_, request);
    ASSERT_TRUE(there.status.ok()) << there.status.error_message();
    Collector here;
    ASSERT_TRUE(RunSolveToEnd(request, SessionLimits(), "here", SolveControl(), here).ok());
    ASSERT_EQ(Count(there.events, v1::SolveEvent::kGap), 0);
    const Told server = WhatIsTold(there.events);
    const Told process = WhatIsTold(here.events);
    EXPECT_EQ(server.words, process.words) << v1::Method_Name(method);
    ASSERT_EQ(server.numbers.size(), process.numbers.size());
    for (std::size_t i = 0; i < server.numbers.size(); ++i) {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(server.numbers[i]), std::bit_cast<std::uint64_t>(process.numbers[i]))
          << v1::Method_Name(method) << ", number " << i << ": " << server.numbers[i] << ", " << process.numbers[i];
    }
  }
}

TEST_F(SolverServiceTest, TheTrajectoryArrivesWhileTheEngineMarches) {
  v1::SolveRequest request = testing::SwitchingRequest(1'000'000);
  request.mutable_options()->set_method(v1::METHOD_EXPONENTIAL_INTEGRATOR);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(100));
  const auto reader = stub_->Solve(&context, request);
  std::vector<v1::SolveEvent> events;
  bool marched = false;
  for (v1::SolveEvent event; reader->Read(&event);) {
    marched = marched || (event.has_trajectory() && server_->solves() == 1);
    events.push_back(event);
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(marched);
  EXPECT_EQ(WhatIsWrongWithOrder(events), "");
}

TEST_F(SolverServiceTest, TwoSolvesInterleaveTheirIterates) {
  // Both read until both have a hundred iterates: solved one after the other, the first would have ended
  // before. Windows of 300 steps make fewer events than a reader takes: of those of single steps, windows
  // alone fill the buffer and hardly an iterate is left.
  constexpr int kEnough = 100;
  v1::SolveRequest request = testing::ChattyRequest(3'000'000 / testing::kSlowness);
  request.mutable_options()->set_window_steps(300);
  std::atomic<int> iterates[2] = {0, 0};
  const auto watch = [&](int self) {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(100));
    const auto reader = stub_->Solve(&context, request);
    for (v1::SolveEvent event; reader->Read(&event);) {
      if (event.has_iterate()) ++iterates[self];
      if (iterates[0] >= kEnough && iterates[1] >= kEnough) context.TryCancel();
    }
    EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  };
  std::thread first(watch, 0);
  std::thread second(watch, 1);
  first.join();
  second.join();
  EXPECT_GE(iterates[0], kEnough);
  EXPECT_GE(iterates[1], kEnough);
}

TEST_F(SolverServiceTest, CancelEndsTheEngine) {
  for (const v1::SolveRequest& request : {testing::ChattyRequest(5'000'000), testing::SteppingRequest(20'000'000)}) {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(100));
    const auto reader = stub_->Solve(&context, request);
    v1::SolveEvent event;
    while (reader->Read(&event) && !event.has_window_started()) {
    }
    ASSERT_EQ(server_->solves(), 1);
    const auto begin = steady_clock::now();
    context.TryCancel();
    ASSERT_TRUE(WaitForSolves(0));
    EXPECT_LT(SecondsSince(begin), 0.5);
    while (reader->Read(&event)) {
    }
    EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
    EXPECT_TRUE(server_->WaitUntilIdle(seconds(10)));
  }
}

TEST_F(SolverServiceTest, NearTheDeadlineTheTrajectorySoFarArrives) {
  const auto begin = steady_clock::now();
  const Outcome outcome = testing::Solve(*stub_, testing::SteppingRequest(20'000'000 / testing::kSlowness), seconds(4));
  EXPECT_LT(SecondsSince(begin), 4.2);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.events.back().summary().termination(), v1::TERMINATION_DEADLINE);
  EXPECT_THAT(outcome.events.back().summary().message(), HasSubstr("deadline"));
  EXPECT_EQ(WhatIsWrongWithOrder(outcome.events), "");
}

TEST_F(SolverServiceTest, AClientThatDoesNotReadGetsDeadlineExceededAndHoldsNothing) {
  grpc::ClientContext context;
  testing::SetDeadline(context, milliseconds(700));
  const auto reader = stub_->Solve(&context, testing::ChattyRequest(5'000'000));
  ASSERT_TRUE(WaitForSolves(1));
  std::this_thread::sleep_for(milliseconds(1000));
  EXPECT_TRUE(server_->WaitUntilIdle(seconds(2)));
  EXPECT_EQ(server_->solves(), 0);
  for (v1::SolveEvent event; reader->Read(&event);) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(SolverServiceTest, RefusesMoreSolvesThanAllowedAndSaysWhenToComeBack) {
  ServerConfig config;
  config.max_concurrent_solves = 1;
  StartServer(config);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(100));
  const auto running = stub_->Solve(&context, testing::SteppingRequest(20'000'000));
  ASSERT_TRUE(WaitForSolves(1));

  const Outcome refused = testing::Solve(*stub_, testing::SwitchingRequest(10));
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.status.error_message(), HasSubstr("max_concurrent_solves = 1"));
  const absl::Status rich = FromGrpc(refused.status);
  EXPECT_TRUE(rich.GetPayload("type.googleapis.com/google.rpc.RetryInfo").has_value());
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(info.ParseFromString(std::string(*rich.GetPayload("type.googleapis.com/google.rpc.ErrorInfo"))));
  EXPECT_EQ(info.domain(), "dlcs.v1");
  EXPECT_EQ(info.metadata().at("limit"), "max_concurrent_solves");

  const grpc::Status no_analysis = Analyze(*stub_, testing::SwitchingRequest(10).problem()).status;
  EXPECT_EQ(no_analysis.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(no_analysis.error_message(), HasSubstr("max_concurrent_solves = 1"));

  context.TryCancel();
  ASSERT_TRUE(WaitForSolves(0));
  EXPECT_TRUE(testing::Solve(*stub_, testing::SwitchingRequest(10)).status.ok());
  EXPECT_TRUE(Analyze(*stub_, testing::SwitchingRequest(10).problem()).status.ok());
  EXPECT_EQ(running->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(SolverServiceTest, RefusesResultsThatDoNotFitIntoMemoryTogether) {
  ServerConfig config;
  config.max_concurrent_solves = 4;
  config.max_result_bytes = 130'000'000;
  config.max_held_result_bytes = 130'000'000;
  StartServer(config);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(100));
  const auto running = stub_->Solve(&context, testing::SteppingRequest(4'000'000));  // 128 MB
  v1::SolveEvent event;
  ASSERT_TRUE(running->Read(&event));
  EXPECT_TRUE(testing::Solve(*stub_, testing::SwitchingRequest(1000)).status.ok());
  const Outcome refused = testing::Solve(*stub_, testing::SwitchingRequest(1'000'000));
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.status.error_message(), HasSubstr("max_held_result_bytes"));
  const Outcome too_large = testing::Solve(*stub_, testing::SwitchingRequest(5'000'000));
  EXPECT_THAT(too_large.status.error_message(), HasSubstr("max_result_bytes = 160000032"));
  context.TryCancel();
}

TEST_F(SolverServiceTest, RefusesMessagesAboveTheLimit) {
  ServerConfig config;
  config.max_message_bytes = 1'000'000;
  StartServer(config);
  v1::SolveRequest request = testing::SwitchingRequest(10);
  for (int k = 0; k < 200'000; ++k) request.mutable_problem()->add_break_points(k);
  const Outcome outcome = testing::Solve(*stub_, request);
  EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(testing::Solve(*stub_, testing::SwitchingRequest(10)).status.ok());
}

TEST_F(SolverServiceTest, VerdictsOfTheMathematicsAreData) {
  // y = 0 is forced, and x = e^t leaves w = 1 - x negative from t = 0 on... from t = ln 1 on: no solution.
  v1::SolveRequest request = testing::SwitchingRequest(100);
  v1::Problem& problem = *request.mutable_problem();
  *problem.mutable_a() = testing::DenseMatrix(1, 1, {1});
  *problem.mutable_n() = testing::DenseMatrix(1, 1, {-1});
  *problem.mutable_m() = testing::DenseMatrix(1, 1, {-1});
  problem.mutable_g()->mutable_pieces(0)->mutable_formulas()->set_formulas(0, "2");
  problem.mutable_f()->mutable_pieces(0)->mutable_formulas()->set_formulas(0, "0");
  const Outcome outcome = testing::Solve(*stub_, request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const v1::Summary& summary = outcome.events.back().summary();
  EXPECT_EQ(summary.termination(), v1::TERMINATION_INFEASIBLE);
  EXPECT_NEAR(summary.failure_time(), std::log(2.0), 0.11);
}

TEST_F(SolverServiceTest, SolvesSingleLcps) {
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(10));
  v1::SolveLcpRequest request;
  *request.mutable_m() = testing::DenseMatrix(2, 2, {2, 1, 1, 2});
  request.add_q(-5);
  request.add_q(-6);
  v1::SolveLcpResponse response;
  const grpc::Status status = stub_->SolveLcp(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.verdict(), v1::LCP_STATUS_SOLVED);
  EXPECT_NEAR(response.y(0), 4.0 / 3, 1e-14);
}

TEST_F(SolverServiceTest, SolvesDcpsAndKeepsAnswersReceivable) {
  v1::SolveDcpRequest request;
  *request.mutable_m() = testing::DenseMatrix(1, 1, {1});
  for (const double t : {0.0, 1.0}) {
    request.mutable_q()->add_times(t);
    request.mutable_q()->add_values(-t);
  }
  const auto ask = [&](v1::SolveDcpResponse& response) {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(10));
    return stub_->SolveDcp(&context, request, &response);
  };
  v1::SolveDcpResponse response;
  const grpc::Status status = ask(response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(response.solved());
  EXPECT_NEAR(response.v().values(response.v().values_size() - 1), 1, 1e-12);
  request.set_max_step(1e-6);  // 16 MB
  EXPECT_EQ(ask(response).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

// x1' = -x1 + y1, 0 <= y1 ⟂ y1 + y1^3 + x1 - 1 >= 0: y1 = 0 where x1 >= 1.
TEST_F(SolverServiceTest, StreamsANonlinearSolve) {
  v1::SolveRequest request;
  v1::NonlinearProblem& problem = *request.mutable_nonlinear();
  problem.add_f("-x1+y1");
  problem.add_g("y1+y1**3+x1-1");
  problem.add_x0(2);
  problem.set_horizon(2);
  request.mutable_options()->set_steps(400);
  const Outcome outcome = testing::Solve(*stub_, request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(WhatIsWrongWithOrder(outcome.events), "");
  EXPECT_GT(Count(outcome.events, v1::SolveEvent::kIterate), 0);
  const v1::Summary& summary = outcome.events.back().summary();
  EXPECT_EQ(summary.termination(), v1::TERMINATION_REACHED_END);
  EXPECT_LT(summary.certificate().node_residual(), 1e-9);
  for (const v1::SolveEvent& event : outcome.events) {
    if (!event.has_trajectory()) continue;
    const v1::TrajectoryChunk& chunk = event.trajectory();
    for (int k = 0; k < chunk.times_size(); ++k) {
      const double x = chunk.x(k), y = chunk.y(k);
      EXPECT_GE(y, 0);
      EXPECT_NEAR(std::min(y, y + y * y * y + x - 1), 0, 1e-9);
      if (chunk.times(k) < std::log(2.0) - 0.01) {
        EXPECT_NEAR(x, 2 * std::exp(-chunk.times(k)), 1e-5);
      }
    }
  }
}

TEST_F(SolverServiceTest, NamesTheFormulaOfANonlinearProblemThatDoesNotParse) {
  v1::SolveRequest request;
  v1::NonlinearProblem& problem = *request.mutable_nonlinear();
  problem.add_f("-x1+y1");
  problem.add_g("y1+x2");
  problem.add_x0(2);
  problem.set_horizon(2);
  const Outcome outcome = testing::Solve(*stub_, request);
  EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(outcome.status.error_message(), HasSubstr("g[0]"));
}

TEST_F(SolverServiceTest, AnalyzesAndRecommendsWhatThenSolves) {
  v1::SolveRequest solve = testing::SwitchingRequest(100);
  const Analyzed analyzed = Analyze(*stub_, solve.problem());
  ASSERT_TRUE(analyzed.status.ok()) << analyzed.status.error_message();
  EXPECT_EQ(analyzed.response.states(), 1);
  EXPECT_EQ(analyzed.response.constraints(), 1);
  EXPECT_EQ(analyzed.response.horizon(), 10);
  EXPECT_THAT(analyzed.response.matrix_class(), HasSubstr("P-"));
  EXPECT_EQ(server_->solves(), 0);

  *solve.mutable_options() = analyzed.response.recommendation().options();
  const Outcome outcome = testing::Solve(*stub_, solve);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.events.back().summary().termination(), v1::TERMINATION_REACHED_END);
}

TEST_F(SolverServiceTest, RefusesToAnalyzeWhatIsAboveItsLimits) {
  ServerConfig config;
  config.max_states = 1;
  StartServer(config);
  v1::Problem problem = testing::SwitchingRequest(10).problem();
  *problem.mutable_a() = testing::DenseMatrix(2, 2, {1, 0, 0, 1});
  const Analyzed analyzed = Analyze(*stub_, problem);
  EXPECT_EQ(analyzed.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(analyzed.status.error_message(), HasSubstr("max_states"));
}

TEST_F(SolverServiceTest, TellsItsCapabilities) {
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(10));
  v1::GetCapabilitiesResponse response;
  ASSERT_TRUE(stub_->GetCapabilities(&context, v1::GetCapabilitiesRequest(), &response).ok());
  EXPECT_EQ(response.version(), DLCS_VERSION);
  EXPECT_EQ(response.methods_size(), v1::Method_ARRAYSIZE);
  EXPECT_EQ(response.methods(1).name(), "laplace-iteration");
  EXPECT_EQ(response.max_steps(), ServerConfig().max_steps);
  EXPECT_GE(response.max_concurrent_solves(), 2);
  EXPECT_GE(response.threads(), 1);
}

TEST_F(SolverServiceTest, SharesSetUpsBetweenSolvesOfTheSameMatrices) {
  const auto statistics = [&] {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(10));
    v1::GetCapabilitiesResponse response;
    EXPECT_TRUE(stub_->GetCapabilities(&context, v1::GetCapabilitiesRequest(), &response).ok());
    return response.setup_cache();
  };
  const Outcome first = testing::Solve(*stub_, testing::SwitchingRequest(100));
  const v1::SetupCacheStatistics before = statistics();
  EXPECT_GT(before.misses(), 0);
  EXPECT_GT(before.bytes(), 0);
  EXPECT_GT(before.max_bytes(), before.bytes());
  v1::SolveRequest other = testing::SwitchingRequest(100);
  other.mutable_problem()->set_x0(0, 0.25);
  ASSERT_TRUE(testing::Solve(*stub_, other).status.ok());
  const Outcome again = testing::Solve(*stub_, testing::SwitchingRequest(100));
  const v1::SetupCacheStatistics after = statistics();
  EXPECT_EQ(after.misses(), before.misses());
  EXPECT_GT(after.hits(), before.hits());
  EXPECT_EQ(WhatIsTold(again.events).numbers, WhatIsTold(first.events).numbers);
}

// One malformed request per case, and the field that has to be named.
struct Malformed {
  const char* name;
  const char* field;
  std::function<void(v1::SolveRequest&)> spoil;
};

class MalformedRequestTest : public ServiceTest, public ::testing::WithParamInterface<Malformed> {};

TEST_P(MalformedRequestTest, IsInvalidArgumentWithTheFieldsName) {
  v1::SolveRequest request = testing::SwitchingRequest(100);
  GetParam().spoil(request);
  const Outcome outcome = testing::Solve(*stub_, request);
  EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << outcome.status.error_message();
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(FromGrpc(outcome.status))) {
    fields.push_back(violation.field);
    EXPECT_NE(violation.description, "");
  }
  EXPECT_THAT(fields, ::testing::Contains(GetParam().field));
  EXPECT_THAT(outcome.status.error_message(), HasSubstr(GetParam().field));
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void SetFormula(v1::SolveRequest& request, const char* formula) {
  request.mutable_problem()->mutable_f()->mutable_pieces(0)->mutable_formulas()->set_formulas(0, formula);
}

INSTANTIATE_TEST_SUITE_P(
    All, MalformedRequestTest,
    ::testing::Values(
        Malformed{"NothingSet", "problem", [](v1::SolveRequest& r) { r.Clear(); }},
        Malformed{"MatrixUnset", "problem.n", [](v1::SolveRequest& r) { r.mutable_problem()->clear_n(); }},
        Malformed{"MatrixCount", "problem.b",
                  [](v1::SolveRequest& r) { r.mutable_problem()->mutable_b()->mutable_dense()->add_values(1); }},
        Malformed{"MatrixNegativeShape", "problem.m",
                  [](v1::SolveRequest& r) { r.mutable_problem()->mutable_m()->mutable_dense()->set_rows(-1); }},
        Malformed{"MatrixShape", "problem.a",
                  [](v1::SolveRequest& r) {
                    *r.mutable_problem()->mutable_a() = testing::DenseMatrix(1, 2, {1, 2});
                  }},
        Malformed{"MatrixNaN", "problem.m[0][0]",
                  [](v1::SolveRequest& r) { *r.mutable_problem()->mutable_m() = testing::DenseMatrix(1, 1, {kNaN}); }},
        Malformed{"MatrixInfinite", "problem.a[0][0]",
                  [](v1::SolveRequest& r) {
                    *r.mutable_problem()->mutable_a() = testing::DenseMatrix(1, 1, {kInfinity});
                  }},
        Malformed{"InitialStateShape", "problem.x0", [](v1::SolveRequest& r) { r.mutable_problem()->add_x0(2); }},
        Malformed{"InitialStateNaN", "problem.x0[0]",
                  [](v1::SolveRequest& r) { r.mutable_problem()->set_x0(0, kNaN); }},
        Malformed{"HorizonZero", "problem.horizon", [](v1::SolveRequest& r) { r.mutable_problem()->set_horizon(0); }},
        Malformed{"HorizonInfinite", "problem.horizon",
                  [](v1::SolveRequest& r) { r.mutable_problem()->set_horizon(kInfinity); }},
        Malformed{"BreakPointOutside", "problem.break_points[0]",
                  [](v1::SolveRequest& r) { r.mutable_problem()->add_break_points(11); }},
        Malformed{"StateName", "problem.state_names[0]",
                  [](v1::SolveRequest& r) { r.mutable_problem()->add_state_names("t"); }},
        Malformed{"PairNames", "problem.pair_names",
                  [](v1::SolveRequest& r) {
                    for (const char* name : {"D1", "D2"}) r.mutable_problem()->add_pair_names(name);
                  }},
        Malformed{"FunctionUnset", "problem.g", [](v1::SolveRequest& r) { r.mutable_problem()->clear_g(); }},
        Malformed{"PieceUnset", "problem.f.pieces[1]",
                  [](v1::SolveRequest& r) { r.mutable_problem()->mutable_f()->add_pieces()->set_start(1); }},
        Malformed{"FormulaSyntax", "problem.f[0]", [](v1::SolveRequest& r) { SetFormula(r, "sin(t"); }},
        Malformed{"FormulaUnknownName", "problem.f[0]", [](v1::SolveRequest& r) { SetFormula(r, "speed*t"); }},
        Malformed{"FormulaAssignment", "problem.f[0]", [](v1::SolveRequest& r) { SetFormula(r, "t = 5"); }},
        Malformed{"FormulaNotFinite", "problem.f[0]", [](v1::SolveRequest& r) { SetFormula(r, "1/(t-5)"); }},
        Malformed{"FormulaCount", "problem.f",
                  [](v1::SolveRequest& r) {
                    r.mutable_problem()->mutable_f()->mutable_pieces(0)->mutable_formulas()->add_formulas("1");
                  }},
        Malformed{"SamplesCount", "problem.f.pieces[0].samples",
                  [](v1::SolveRequest& r) {
                    auto& problem = *r.mutable_problem();
                    *problem.mutable_a() = testing::DenseMatrix(2, 2, {1, 0, 0, 1});
                    *problem.mutable_b() = testing::DenseMatrix(2, 1, {1, 0});
                    *problem.mutable_n() = testing::DenseMatrix(1, 2, {1, 0});
                    problem.add_x0(1);
                    auto& samples = *problem.mutable_f()->mutable_pieces(0)->mutable_samples();
                    for (const double value : {0.0, 1.0}) samples.add_times(value);
                    for (const double value : {0.0, 1.0, 2.0}) samples.add_values(value);
                  }},
        Malformed{"RuleUnknown", "problem.rule",
                  [](v1::SolveRequest& r) { r.mutable_problem()->set_rule(static_cast<v1::SolutionRule>(9)); }},
        Malformed{"RuleNotAdmitted", "problem.rule",
                  [](v1::SolveRequest& r) {
                    *r.mutable_problem()->mutable_m() = testing::DenseMatrix(1, 1, {0});
                    r.mutable_problem()->set_rule(v1::SOLUTION_RULE_UNIQUE);
                  }},
        Malformed{"MethodUnknown", "options.method",
                  [](v1::SolveRequest& r) { r.mutable_options()->set_method(static_cast<v1::Method>(77)); }},
        Malformed{"StepsNegative", "options.steps", [](v1::SolveRequest& r) { r.mutable_options()->set_steps(-5); }},
        Malformed{"StepZero", "options.step", [](v1::SolveRequest& r) { r.mutable_options()->set_step(0); }},
        Malformed{"OutputTimesOrder", "options.output_times[1]",
                  [](v1::SolveRequest& r) {
                    r.mutable_options()->add_output_times(2);
                    r.mutable_options()->add_output_times(1);
                  }},
        Malformed{"Theta", "options.theta", [](v1::SolveRequest& r) { r.mutable_options()->set_theta(1.5); }},
        Malformed{"Tolerance", "options.iteration_tolerance",
                  [](v1::SolveRequest& r) { r.mutable_options()->set_iteration_tolerance(-1); }},
        Malformed{"Threads", "options.threads", [](v1::SolveRequest& r) { r.mutable_options()->set_threads(-1); }},
        Malformed{"ContourNodes", "options.contour.nodes",
                  [](v1::SolveRequest& r) { r.mutable_options()->mutable_contour()->set_nodes(-3); }}),
    [](const ::testing::TestParamInfo<Malformed>& malformed) { return malformed.param.name; });

}  // namespace
}  // namespace dlcs
