// SPDX-License-Identifier: Apache-2.0
// A real server in the test process and real stubs to call it with.

#ifndef DLCS_TESTS_SERVER_SERVICE_FIXTURE_H_
#define DLCS_TESTS_SERVER_SERVICE_FIXTURE_H_

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dlcs/v1/solver.grpc.pb.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"

namespace dlcs::testing {

inline void SetDeadline(grpc::ClientContext& context, std::chrono::milliseconds timeout) {
  context.set_deadline(std::chrono::system_clock::now() + timeout);
}

// A channel of its own: gRPC shares connections between channels with equal arguments.
inline std::shared_ptr<grpc::Channel> Connect(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

struct Outcome {
  std::vector<v1::SolveEvent> events;
  grpc::Status status;
};

// Reads one solve to its end.
inline Outcome Solve(v1::SolverService::Stub& stub, const v1::SolveRequest& request,
                     std::chrono::milliseconds timeout = std::chrono::seconds(120)) {
  grpc::ClientContext context;
  SetDeadline(context, timeout);
  const auto reader = stub.Solve(&context, request);
  Outcome outcome;
  for (v1::SolveEvent event; reader->Read(&event);) outcome.events.push_back(event);
  outcome.status = reader->Finish();
  return outcome;
}

class ServiceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);  // passing tests print nothing
    StartServer(ServerConfig());
  }

  void StartServer(ServerConfig config) {
    stub_.reset();
    server_.reset();
    config.listen = "127.0.0.1:0";
    auto server = DlcsServer::Start(config);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    stub_ = v1::SolverService::NewStub(Connect(server_->address()));
  }

  // Waits until the number of running engines is `solves`; false after a minute.
  bool WaitForSolves(int solves) const {
    for (int i = 0; i < 6000; ++i) {
      if (server_->solves() == solves) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  std::unique_ptr<DlcsServer> server_;
  std::unique_ptr<v1::SolverService::Stub> stub_;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SERVICE_FIXTURE_H_
