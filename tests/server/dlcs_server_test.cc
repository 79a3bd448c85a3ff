// SPDX-License-Identifier: Apache-2.0
#include "server/dlcs_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "google/protobuf/descriptor.h"
#include "google/protobuf/message.h"
#include "google/protobuf/text_format.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "grpcpp/impl/codegen/client_unary_call.h"
#include "grpcpp/support/sync_stream.h"
#include "tests/server/service_fixture.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::Outcome;

using DlcsServerTest = testing::ServiceTest;
using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

HealthCheckResponse::ServingStatus Health(const std::shared_ptr<grpc::Channel>& channel, const std::string& service) {
  const auto stub = grpc::health::v1::Health::NewStub(channel);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(10));
  HealthCheckRequest request;
  request.set_service(service);
  HealthCheckResponse response;
  const grpc::Status status = stub->Check(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.status();
}

TEST_F(DlcsServerTest, HealthIsServingUntilItDrains) {
  const auto channel = testing::Connect(server_->address());
  EXPECT_EQ(Health(channel, ""), HealthCheckResponse::SERVING);
  EXPECT_EQ(Health(channel, "dlcs.v1.SolverService"), HealthCheckResponse::SERVING);
  server_->Drain();
  EXPECT_EQ(Health(channel, ""), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(Health(channel, "dlcs.v1.SolverService"), HealthCheckResponse::NOT_SERVING);
}

TEST_F(DlcsServerTest, RefusesNewCallsWhileItDrains) {
  server_->Drain();
  const Outcome solve = testing::Solve(*stub_, testing::SwitchingRequest(10));
  EXPECT_EQ(solve.status.error_code(), grpc::StatusCode::UNAVAILABLE);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(10));
  v1::SolveLcpResponse response;
  EXPECT_EQ(stub_->SolveLcp(&context, v1::SolveLcpRequest(), &response).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(DlcsServerTest, StopLetsRunningSolvesTellTheirSummary) {
  Outcome outcome;
  std::thread client([&] { outcome = testing::Solve(*stub_, testing::SteppingRequest(20'000'000)); });
  ASSERT_TRUE(WaitForSolves(1));
  std::this_thread::sleep_for(milliseconds(100));
  server_->Stop(seconds(10));
  client.join();
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.events.back().summary().termination(), v1::TERMINATION_CANCELLED);
  EXPECT_THAT(outcome.events.back().summary().message(), HasSubstr("shutting down"));
}

TEST_F(DlcsServerTest, StopDoesNotWaitForAClientThatDoesNotRead) {
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(100));
  // 12 MB of trajectory, far more than what gRPC holds in transit.
  const auto reader = stub_->Solve(&context, testing::SteppingRequest(500'000));
  v1::SolveEvent accepted;
  ASSERT_TRUE(reader->Read(&accepted));
  ASSERT_TRUE(WaitForSolves(0));
  ASSERT_FALSE(server_->WaitUntilIdle(milliseconds(100)));
  const auto begin = std::chrono::steady_clock::now();
  server_->Stop(milliseconds(300));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(3));
  for (v1::SolveEvent event; reader->Read(&event);) {
  }
  EXPECT_FALSE(reader->Finish().ok());
}

// Messages of the reflection protocol, from the descriptors that gRPC's plug-in has in it (Debian ships no
// header).
std::unique_ptr<google::protobuf::Message> ReflectionMessage(const std::string& name) {
  const auto* descriptor =
      google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName("grpc.reflection.v1alpha." + name);
  return std::unique_ptr<google::protobuf::Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(descriptor)->New());
}

TEST_F(DlcsServerTest, ReflectionDescribesEveryServiceWhereItIsAskedFor) {
  using google::protobuf::Message;
  ServerConfig config;
  config.reflection = true;
  StartServer(config);
  const auto channel = testing::Connect(server_->address());
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(10));
  const grpc::internal::RpcMethod method("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                         grpc::internal::RpcMethod::BIDI_STREAMING);
  const std::unique_ptr<grpc::ClientReaderWriter<Message, Message>> stream(
      grpc::internal::ClientReaderWriterFactory<Message, Message>::Create(channel.get(), method, &context));
  const auto ask = [&stream](const std::string& question) {
    const auto request = ReflectionMessage("ServerReflectionRequest");
    const auto response = ReflectionMessage("ServerReflectionResponse");
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(question, request.get()));
    EXPECT_TRUE(stream->Write(*request) && stream->Read(response.get()));
    return response->DebugString();
  };

  const std::string services = ask("list_services: '*'");
  EXPECT_THAT(services, HasSubstr("name: \"dlcs.v1.SolverService\""));
  EXPECT_THAT(services, HasSubstr("name: \"grpc.health.v1.Health\""));
  EXPECT_THAT(ask("file_containing_symbol: 'dlcs.v1.SolverService'"), HasSubstr("dlcs/v1/solver.proto"));
  EXPECT_THAT(ask("file_containing_symbol: 'grpc.health.v1.Health'"), HasSubstr("grpc/health/v1/health.proto"));
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

// Calls any method with an empty message, and returns the status.
grpc::StatusCode CodeOf(const std::string& address, const char* name) {
  const auto channel = testing::Connect(address);
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(10));
  const grpc::internal::RpcMethod method(name, grpc::internal::RpcMethod::NORMAL_RPC);
  HealthCheckRequest request;
  HealthCheckResponse response;
  return grpc::internal::BlockingUnaryCall<HealthCheckRequest, HealthCheckResponse>(channel.get(), method, &context,
                                                                                    request, &response)
      .error_code();
}

TEST_F(DlcsServerTest, ThereIsNoReflectionUnlessItIsAskedFor) {
  EXPECT_EQ(CodeOf(server_->address(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(DlcsServerTest, HealthOfAnUnknownServiceIsNotFound) {
  const auto stub = grpc::health::v1::Health::NewStub(testing::Connect(server_->address()));
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(10));
  HealthCheckRequest request;
  request.set_service("dlcs.v1.NoSuchService");
  HealthCheckResponse response;
  EXPECT_EQ(stub->Check(&context, request, &response).error_code(), grpc::StatusCode::NOT_FOUND);
}

// Reads a stream of health messages until one is `status`. False if the call ends before.
bool ReadUntil(HealthCheckResponse::ServingStatus status, grpc::ClientReader<HealthCheckResponse>& watch) {
  for (HealthCheckResponse response; watch.Read(&response);) {
    if (response.status() == status) return true;
  }
  return false;
}

TEST_F(DlcsServerTest, HealthOfJobsFollowsTheStoreForThoseWhoWatch) {
  const jobs::testing::TemporaryFolder folder;
  ServerConfig config;
  config.store = folder.File("jobs.db");
  StartServer(config);
  const auto stub = grpc::health::v1::Health::NewStub(testing::Connect(server_->address()));
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(60));
  HealthCheckRequest request;
  request.set_service("dlcs.v1.JobService");
  const auto watch = stub->Watch(&context, request);
  EXPECT_TRUE(ReadUntil(HealthCheckResponse::SERVING, *watch));
  std::filesystem::rename(config.store, folder.File("elsewhere.db"));
  EXPECT_TRUE(ReadUntil(HealthCheckResponse::NOT_SERVING, *watch));
  EXPECT_EQ(Health(testing::Connect(server_->address()), "dlcs.v1.SolverService"), HealthCheckResponse::SERVING);
  std::filesystem::rename(folder.File("elsewhere.db"), config.store);
  EXPECT_TRUE(ReadUntil(HealthCheckResponse::SERVING, *watch));
  context.TryCancel();
}

TEST_F(DlcsServerTest, TakenPortIsAClearError) {
  ServerConfig config;
  config.listen = server_->address();
  const auto second = DlcsServer::Start(config);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(server_->address() + ": the port is taken"));
}

TEST_F(DlcsServerTest, PortsAreFreeAgainAfterTheServer) {
  ServerConfig config;
  config.listen = server_->address();
  EXPECT_TRUE(testing::Solve(*stub_, testing::SwitchingRequest(10)).status.ok());
  server_.reset();
  EXPECT_TRUE(DlcsServer::Start(config).ok());
}

TEST(ServerConfigTest, NamesTheFlagAndTheRule) {
  ServerConfig config;
  EXPECT_TRUE(Validate(config).ok());
  config.max_steps = 0;
  EXPECT_THAT(std::string(Validate(config).message()), HasSubstr("--max-steps 0: must be at least 1"));
  config = ServerConfig();
  config.max_held_result_bytes = config.max_result_bytes - 1;
  EXPECT_THAT(std::string(Validate(config).message()), HasSubstr("--max-held-result-bytes"));
  EXPECT_GE(Resolved(ServerConfig()).max_concurrent_solves, 2);
}

}  // namespace
}  // namespace dlcs
