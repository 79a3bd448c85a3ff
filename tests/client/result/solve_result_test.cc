// SPDX-License-Identifier: Apache-2.0
// A client must not trust a server: a fake server that breaks the contract.
#include "client/result/solve_result.h"

#include <gmock/gmock.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/rpc/client.h"

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Sends `events` to every caller, then `status`.
class FakeService final : public v1::SolverService::Service {
 public:
  grpc::Status Solve(grpc::ServerContext*, const v1::SolveRequest*,
                     grpc::ServerWriter<v1::SolveEvent>* writer) override {
    for (const v1::SolveEvent& event : events) writer->Write(event);
    return status;
  }

  std::vector<v1::SolveEvent> events;
  grpc::Status status;
};

class FakeServerTest : public ::testing::Test {
 protected:
  FakeServerTest() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    client_ = Client::Connect("127.0.0.1:" + std::to_string(port)).value();
  }

  absl::StatusOr<SolveResult> Solve(const EventCallback& on_event = {}, const CallLimits& limits = {}) {
    v1::SolveRequest request;
    request.mutable_problem()->add_x0(1);
    request.mutable_problem()->mutable_m()->mutable_dense()->set_rows(1);
    return client_->Solve(request, on_event, limits);
  }

  void SendChunk(std::int64_t first, std::vector<double> times, std::vector<double> x, std::vector<double> y) {
    v1::TrajectoryChunk& chunk = *service_.events.emplace_back().mutable_trajectory();
    chunk.set_first(first);
    chunk.mutable_times()->Add(times.begin(), times.end());
    chunk.mutable_x()->Add(x.begin(), x.end());
    chunk.mutable_y()->Add(y.begin(), y.end());
  }

  void SendSummary(std::int64_t times) {
    v1::Summary& summary = *service_.events.emplace_back().mutable_summary();
    summary.set_termination(v1::TERMINATION_REACHED_END);
    summary.set_times(times);
  }

  FakeService service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(FakeServerTest, JoinsChunks) {
  SendChunk(0, {0, 1}, {10, 11}, {20, 21});
  SendChunk(2, {2}, {12}, {22});
  SendSummary(3);
  const auto result = Solve();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->times, ElementsAre(0, 1, 2));
  EXPECT_THAT(result->x, ElementsAre(10, 11, 12));
  EXPECT_EQ(result->y_at(2)[0], 22);
  EXPECT_FALSE(result->has_w()) << "an older server sends none";
  EXPECT_TRUE(result->w_at(2).empty());
}

TEST_F(FakeServerTest, JoinsW) {
  SendChunk(0, {0, 1}, {10, 11}, {20, 21});
  for (const double w : {30, 31}) service_.events.back().mutable_trajectory()->add_w(w);
  SendChunk(2, {2}, {12}, {22});
  service_.events.back().mutable_trajectory()->add_w(32);
  SendSummary(3);
  const auto result = Solve();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->w, ElementsAre(30, 31, 32));
  EXPECT_EQ(result->w_at(1)[0], 31);
}

TEST_F(FakeServerTest, NoticesAChunkWithoutItsW) {
  SendChunk(0, {0, 1}, {10, 11}, {20, 21});
  for (const double w : {30, 31}) service_.events.back().mutable_trajectory()->add_w(w);
  SendChunk(2, {2}, {12}, {22});
  SendSummary(3);
  EXPECT_EQ(Solve().status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(FakeServerTest, NoticesAMissingChunk) {
  SendChunk(0, {0, 1}, {10, 11}, {20, 21});
  SendChunk(3, {2}, {12}, {22});
  SendSummary(3);
  EXPECT_EQ(Solve().status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(FakeServerTest, NoticesAChunkOfTheWrongShape) {
  SendChunk(0, {0, 1}, {10, 11, 12}, {20, 21});
  SendSummary(2);
  EXPECT_EQ(Solve().status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(FakeServerTest, NoticesATrajectoryThatIsTooShort) {
  SendChunk(0, {0}, {10}, {20});
  SendSummary(2);
  EXPECT_THAT(std::string(Solve().status().message()), HasSubstr("2 were announced"));
}

TEST_F(FakeServerTest, KeepsNoTrajectoryWhereItIsToldSo) {
  SendChunk(0, {0, 1}, {10, 11}, {20, 21});
  SendChunk(2, {2}, {12}, {22});
  SendSummary(3);
  int times = 0;
  const auto count = [&times](const v1::SolveEvent& event) { times += event.trajectory().times_size(); };
  const CallLimits limits{.stop = {}, .keep_trajectory = false};
  const auto result = Solve(count, limits);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(times, 3);
  EXPECT_TRUE(result->times.empty() && result->x.empty() && result->y.empty());
  service_.events.erase(service_.events.begin());
  EXPECT_THAT(std::string(Solve(count, limits).status().message()), HasSubstr("at index 2 does not continue it at 0"));
}

TEST_F(FakeServerTest, NoticesAMissingSummary) {
  SendChunk(0, {0}, {10}, {20});
  EXPECT_THAT(std::string(Solve().status().message()), HasSubstr("without a summary"));
}

TEST_F(FakeServerTest, KeepsASummaryThatCameBeforeABadStatus) {
  SendSummary(0);
  service_.status = grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "");
  ASSERT_TRUE(Solve().ok());
  EXPECT_EQ(Solve()->summary.termination(), v1::TERMINATION_REACHED_END);
}

TEST_F(FakeServerTest, TellsAServerWithoutTheService) {
  const auto response = client_->GetCapabilities({});
  EXPECT_EQ(response.status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(response.status().message()), HasSubstr("Is it a dlcsd of this version?"));
}

}  // namespace
}  // namespace dlcs::client
