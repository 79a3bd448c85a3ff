// SPDX-License-Identifier: Apache-2.0
// A real server in the test process and real stubs to call it with.

#ifndef DLCS_TESTS_SERVER_SERVICE_FIXTURE_H_
#define DLCS_TESTS_SERVER_SERVICE_FIXTURE_H_

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "dlcs/v1/solver.grpc.pb.h"
#include "grpcpp/channel.h"
#include "grpcpp/client_context.h"
#include "server/dlcs_server.h"

namespace dlcs::testing {

void SetDeadline(grpc::ClientContext& context, std::chrono::milliseconds timeout);

// A channel of its own: gRPC shares connections between channels with equal arguments.
std::shared_ptr<grpc::Channel> Connect(const std::string& address);

struct Outcome {
  std::vector<v1::SolveEvent> events;
  grpc::Status status;
};

// Reads one solve to its end.
Outcome Solve(v1::SolverService::Stub& stub, const v1::SolveRequest& request,
              std::chrono::milliseconds timeout = std::chrono::seconds(120));

class ServiceTest : public ::testing::Test {
 protected:
  void SetUp() override;

  void StartServer(ServerConfig config);

  // Waits until the number of running engines is `solves`; false after a minute.
  bool WaitForSolves(int solves) const;

  std::unique_ptr<DlcsServer> server_;
  std::unique_ptr<v1::SolverService::Stub> stub_;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SERVICE_FIXTURE_H_
