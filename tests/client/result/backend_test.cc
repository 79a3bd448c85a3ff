// SPDX-License-Identifier: Apache-2.0
// The two back ends against each other, and the client against a real server.
#include "client/result/backend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/output/message_json.h"
#include "client/files/lcp_file.h"
#include "client/files/problem_file.h"
#include "client/local/local_backend.h"
#include "client/rpc/client.h"
#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

v1::SolveRequest CaseRequest(const std::string& name) {
  const auto file = ReadProblemFile(dlcs::testing::CasePath(name));
  EXPECT_TRUE(file.ok()) << file.status();
  v1::SolveRequest request;
  if (file.ok()) *request.mutable_problem() = file->problem;
  return request;
}

// The output for people and programs, without the seconds, which differ from run to run.
std::string JsonWithoutSeconds(SolveResult result) {
  v1::Cost& cost = *result.summary.mutable_cost();
  cost.clear_seconds_setup();
  cost.clear_seconds_lcp();
  cost.clear_seconds_linear();
  cost.clear_seconds_certificate();
  cost.clear_seconds_total();
  cost.clear_process_peak_bytes();
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  PrintJson("", result, stream);
  std::fclose(stream);
  const std::string json(text, size);
  std::free(text);
  return json;
}

class BackendTest : public ::testing::Test {
 protected:
  BackendTest() {
    spdlog::set_level(spdlog::level::off);  // passing tests print nothing
    ServerConfig config;
    config.listen = "127.0.0.1:0";
    auto server = DlcsServer::Start(config);
    EXPECT_TRUE(server.ok()) << server.status();
    if (server.ok()) server_ = *std::move(server);
  }

  void SetUp() override {
    ASSERT_NE(server_, nullptr);
    auto client = Client::Connect(server_->address());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  std::unique_ptr<DlcsServer> server_;
  std::unique_ptr<Client> client_;
  LocalBackend local_;
};

struct Twin {
  std::string name;  // of the case
  v1::Method method = v1::METHOD_UNSPECIFIED;
  bool project = false;
};

std::ostream& operator<<(std::ostream& stream, const Twin& twin) { return stream << twin.name; }

class SameBitsTest : public BackendTest, public ::testing::WithParamInterface<Twin> {};

TEST_P(SameBitsTest, HereAndOnAServer) {
  v1::SolveRequest request = CaseRequest(GetParam().name);
  request.mutable_options()->set_method(GetParam().method);
  request.mutable_options()->set_project_initial_state(GetParam().project);
  const auto here = local_.Solve(request, {}, {});
  const auto there = client_->Solve(request, {}, {});
  ASSERT_TRUE(here.ok()) << here.status();
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_EQ(JsonWithoutSeconds(*here), JsonWithoutSeconds(*there));
  EXPECT_FALSE(here->summary.message().empty());
}

INSTANTIATE_TEST_SUITE_P(Cases, SameBitsTest,
                         ::testing::Values(Twin{"rlcd"}, Twin{"z_least"}, Twin{"train_brakes"}, Twin{"wall_permeable"},
                                           Twin{"formula_zoo"}, Twin{"saturated_pd", v1::METHOD_EXPONENTIAL_INTEGRATOR},
                                           Twin{"vickrey", v1::METHOD_TIME_STEPPING},
                                           Twin{"diode_bridge_cap", v1::METHOD_TIME_STEPPING, true},
                                           Twin{"diode_bridge_cap"}, Twin{"outside_infeasible"},
                                           Twin{"outside_triple_integrator"}),
                         [](const ::testing::TestParamInfo<Twin>& twin) {
                           return std::to_string(twin.index) + twin.param.name;
                         });

TEST_F(BackendTest, HandsOverEveryEventInOrder) {
  std::vector<v1::SolveEvent> events;
  const auto result =
      client_->Solve(CaseRequest("rlcd"), [&](const v1::SolveEvent& event) { events.push_back(event); }, {});
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_GE(events.size(), 4U);
  EXPECT_TRUE(events.front().has_accepted());
  EXPECT_TRUE(events[1].has_analysis());
  EXPECT_TRUE(events.back().has_summary());
  for (std::size_t i = 1; i < events.size(); ++i) EXPECT_GT(events[i].sequence(), events[i - 1].sequence());
}

TEST_F(BackendTest, RefusesABrokenProblemInTheSameWords) {
  v1::SolveRequest request = CaseRequest("rlcd");
  request.mutable_problem()->add_x0(std::nan(""));
  request.mutable_options()->set_theta(7);
  const auto here = local_.Solve(request, {}, {});
  const auto there = client_->Solve(request, {}, {});
  EXPECT_EQ(here.status(), there.status());
  EXPECT_EQ(here.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(here.status().message()), AllOf(HasSubstr("x0"), HasSubstr("theta: ")));
}

TEST_F(BackendTest, SolvesAnLcpInBothPlaces) {
  const auto request = ParseLcp(R"({"M": [[2, 1], [1, 2]], "q": [-5, -6]})", "");
  ASSERT_TRUE(request.ok());
  const auto here = local_.SolveLcp(*request, {});
  const auto there = client_->SolveLcp(*request, {});
  ASSERT_TRUE(here.ok()) << here.status();
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_EQ(here->SerializeAsString(), there->SerializeAsString());
  EXPECT_EQ(here->verdict(), v1::LCP_STATUS_SOLVED);
  EXPECT_NEAR(here->y(0), 4.0 / 3, 1e-15);
  EXPECT_NEAR(here->y(1), 7.0 / 3, 1e-15);
}

TEST_F(BackendTest, AnalysesInBothPlacesWithTheSameWords) {
  v1::AnalyzeProblemRequest request;
  *request.mutable_problem() = CaseRequest("rlcd").problem();
  auto here = local_.AnalyzeProblem(request, {});
  auto there = client_->AnalyzeProblem(request, {});
  ASSERT_TRUE(here.ok()) << here.status();
  ASSERT_TRUE(there.ok()) << there.status();
  here->clear_seconds();
  there->clear_seconds();
  EXPECT_EQ(here->SerializeAsString(), there->SerializeAsString());
  EXPECT_EQ(here->states(), request.problem().a().dense().rows());
  EXPECT_EQ(here->constraints(), request.problem().m().dense().rows());
  EXPECT_EQ(here->recommendation().options().error_tolerance(), 1e-6);

  request.mutable_problem()->add_x0(std::nan(""));
  request.mutable_options()->set_theta(7);
  const auto refused = local_.AnalyzeProblem(request, {});
  EXPECT_EQ(refused.status(), client_->AnalyzeProblem(request, {}).status());
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()), AllOf(HasSubstr("x0"), HasSubstr("theta: ")));
}

TEST_F(BackendTest, SaysThatAnAnalysisWasStopped) {
  v1::AnalyzeProblemRequest request;
  *request.mutable_problem() = CaseRequest("rlcd").problem();
  std::stop_source source;
  source.request_stop();
  for (Backend* backend : {static_cast<Backend*>(&local_), static_cast<Backend*>(client_.get())}) {
    const auto stopped = backend->AnalyzeProblem(request, {.deadline = 60s, .stop = source.get_token()});
    EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled);
  }
}

TEST_F(BackendTest, RefusesATrajectoryThatNoMemoryHolds) {
  v1::SolveRequest request = CaseRequest("wall_permeable");
  request.mutable_options()->set_steps(1'000'000'000);  // 344 GB
  const auto here = local_.Solve(request, {}, {});
  const auto there = client_->Solve(request, {}, {});
  EXPECT_EQ(here.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(there.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(here.status().message()), HasSubstr("GB of this machine"));
  EXPECT_THAT(std::string(there.status().message()), HasSubstr("max_steps"));
}

TEST_F(BackendTest, ReportsTheLimitsOfTheServer) {
  const auto there = client_->GetCapabilities({});
  const auto here = local_.GetCapabilities({});
  ASSERT_TRUE(there.ok()) << there.status();
  ASSERT_TRUE(here.ok()) << here.status();
  EXPECT_GT(there->max_steps(), 0);
  EXPECT_EQ(here->max_steps(), 0);
  EXPECT_EQ(here->version(), there->version());
  EXPECT_EQ(here->methods_size(), there->methods_size());
}

// Minutes of work in both places: the paper's iteration costs the square of the number of steps.
v1::SolveRequest LongRequest() {
  v1::SolveRequest request;
  request.mutable_problem()->CopyFrom(
      ParseProblem(
          R"json({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4, "f": ["sin(t)"],
                           "g": ["-1"]})json",
          "")
          .value()
          .problem);
  request.mutable_options()->set_method(v1::METHOD_WU_CHEN_ITERATION);
  request.mutable_options()->set_steps(200'000);
  return request;
}

void ExpectEndsEarly(Backend& backend, const CallLimits& limits, v1::Termination termination) {
  const auto start = std::chrono::steady_clock::now();
  const auto result = backend.Solve(LongRequest(), {}, limits);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 5s);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->summary.termination(), termination);
  EXPECT_FALSE(result->summary.message().empty());
}

TEST_F(BackendTest, EndsAtTheDeadlineWithWhatIsKnown) {
  ExpectEndsEarly(local_, {.deadline = 0.5s, .stop = {}}, v1::TERMINATION_DEADLINE);
  ExpectEndsEarly(*client_, {.deadline = 0.5s, .stop = {}}, v1::TERMINATION_DEADLINE);
}

TEST_F(BackendTest, EndsWhenItIsStopped) {
  for (Backend* backend : {static_cast<Backend*>(&local_), static_cast<Backend*>(client_.get())}) {
    std::stop_source source;
    std::jthread stopper([&] {
      std::this_thread::sleep_for(300ms);
      source.request_stop();
    });
    ExpectEndsEarly(*backend, {.deadline = 60s, .stop = source.get_token()}, v1::TERMINATION_CANCELLED);
  }
}

TEST_F(BackendTest, EndsAtOnceWhenItWasStoppedBefore) {
  std::stop_source source;
  source.request_stop();
  ExpectEndsEarly(local_, {.deadline = 60s, .stop = source.get_token()}, v1::TERMINATION_CANCELLED);
  ExpectEndsEarly(*client_, {.deadline = 60s, .stop = source.get_token()}, v1::TERMINATION_CANCELLED);
}

TEST_F(BackendTest, SaysWhatToDoWhenNobodyAnswers) {
  const std::string address = server_->address();
  server_->Stop(0ms);
  const auto result = client_->Solve(CaseRequest("rlcd"), {}, {.deadline = 10s, .stop = {}});
  EXPECT_EQ(result.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(result.status().message()), AllOf(HasSubstr(address), HasSubstr("dlcsd --listen")));
}

TEST(ClientTest, RefusesWhatIsNoAddress) {
  for (const char* address : {"", "localhost", "localhost:", ":50051", "localhost:x", "localhost:0", "localhost:70000",
                              "::1:50051", "http://localhost"}) {
    const auto client = Client::Connect(address);
    EXPECT_EQ(client.status().code(), absl::StatusCode::kInvalidArgument) << address;
    EXPECT_THAT(std::string(client.status().message()), HasSubstr("HOST:PORT")) << address;
  }
  for (const char* address : {"localhost:50051", "[::1]:50051", "10.0.0.7:1"}) {
    EXPECT_TRUE(Client::Connect(address).ok()) << address;
  }
}

// Three members of a case, one of whose problems has another horizon.
v1::SolveEnsembleRequest CaseMembers() {
  v1::SolveEnsembleRequest request;
  *request.mutable_problem() = CaseRequest("rlcd").problem();
  request.mutable_options()->set_steps(200);
  request.add_members()->set_label("as it is");
  v1::EnsembleMember& half = *request.add_members();
  for (const double x0 : request.problem().x0()) half.add_x0(0.5 * x0);
  request.add_members()->set_horizon(request.problem().horizon() / 2);
  return request;
}

TEST_F(BackendTest, AnEnsembleHasTheSameMembersHereAndThere) {
  const v1::SolveEnsembleRequest request = CaseMembers();
  std::map<std::int64_t, std::string> members[2];
  Backend* const backends[2] = {&local_, client_.get()};
  for (int k = 0; k < 2; ++k) {
    const auto summary = backends[k]->SolveEnsemble(request,
                                                    [&](const MemberResult& member) {
                                                      members[k][member.member] =
                                                          member.label + JsonWithoutSeconds(member.result);
                                                    },
                                                    {});
    ASSERT_TRUE(summary.ok()) << summary.status();
    EXPECT_EQ(summary->solved() + summary->reached(), 3);
    EXPECT_GT(summary->setup_hits(), 0);
  }
  ASSERT_EQ(members[0].size(), 3U);
  EXPECT_EQ(members[0], members[1]);
  EXPECT_THAT(members[0][0], HasSubstr("as it is{"));
}

TEST_F(BackendTest, AnEnsembleIsRefusedInTheSameWordsHereAndThere) {
  v1::SolveEnsembleRequest request = CaseMembers();
  request.mutable_members(1)->add_x0(1);
  request.mutable_members(2)->set_horizon(0);
  const auto why_not = [&](Backend& backend) {
    const auto summary = backend.SolveEnsemble(request, [](const MemberResult&) { FAIL(); }, {});
    EXPECT_TRUE(absl::IsInvalidArgument(summary.status()));
    return std::string(summary.status().message());
  };
  EXPECT_EQ(why_not(local_), why_not(*client_));
  EXPECT_THAT(why_not(local_), AllOf(HasSubstr("members[1].x0: "), HasSubstr("\nmembers[2].horizon: ")));
}

TEST_F(BackendTest, AStoppedEnsembleCountsWhatItHas) {
  for (Backend* const backend : {static_cast<Backend*>(&local_), static_cast<Backend*>(client_.get())}) {
    v1::SolveEnsembleRequest request = CaseMembers();
    while (request.members_size() < 1000) *request.add_members() = request.members(0);
    request.mutable_options()->set_steps(20'000);
    std::stop_source stop;
    std::int64_t came = 0;
    const auto summary = backend->SolveEnsemble(request,
                                                [&](const MemberResult&) {
                                                  if (++came == 2) stop.request_stop();
                                                },
                                                {.stop = stop.get_token()});
    ASSERT_TRUE(summary.ok()) << summary.status();
    EXPECT_EQ(summary->solved() + summary->reached() + summary->stopped(), came);
    EXPECT_GT(summary->not_begun(), 0);
    EXPECT_EQ(came + summary->failed() + summary->not_begun(), 1000);
    EXPECT_NE(summary->message(), "");
  }
}

}  // namespace
}  // namespace dlcs::client
