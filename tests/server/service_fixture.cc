// SPDX-License-Identifier: Apache-2.0
#include "tests/server/service_fixture.h"

#include <thread>
#include <utility>

#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "spdlog/spdlog.h"

namespace dlcs::testing {

void SetDeadline(grpc::ClientContext& context, std::chrono::milliseconds timeout) {
  context.set_deadline(std::chrono::system_clock::now() + timeout);
}

std::shared_ptr<grpc::Channel> Connect(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

Outcome Solve(v1::SolverService::Stub& stub, const v1::SolveRequest& request, std::chrono::milliseconds timeout) {
  grpc::ClientContext context;
  SetDeadline(context, timeout);
  const auto reader = stub.Solve(&context, request);
  Outcome outcome;
  for (v1::SolveEvent event; reader->Read(&event);) outcome.events.push_back(event);
  outcome.status = reader->Finish();
  return outcome;
}

void ServiceTest::SetUp() {
  spdlog::set_level(spdlog::level::off);  // passing tests print nothing
  StartServer(ServerConfig());
}

void ServiceTest::StartServer(ServerConfig config) {
  stub_.reset();
  server_.reset();
  config.listen = "127.0.0.1:0";
  auto server = DlcsServer::Start(config);
  ASSERT_TRUE(server.ok()) << server.status();
  server_ = *std::move(server);
  stub_ = v1::SolverService::NewStub(Connect(server_->address()));
}

bool ServiceTest::WaitForSolves(int solves) const {
  for (int i = 0; i < 6000; ++i) {
    if (server_->solves() == solves) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace dlcs::testing
