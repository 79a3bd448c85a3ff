// SPDX-License-Identifier: Apache-2.0
// The client of uploaded problems.
//
//     auto client = dlcs::client::ProblemClient::Connect("localhost:50051");
//     auto uploaded = (*client)->Upload(body, {});
//     request.set_problem_name(uploaded->problem().name());

#ifndef DLCS_CLIENT_RPC_PROBLEM_CLIENT_H_
#define DLCS_CLIENT_RPC_PROBLEM_CLIENT_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/result/backend.h"
#include "client/rpc/retry.h"
#include "dlcs/v1/problems.grpc.pb.h"

namespace dlcs::client {

// A call that gets no answer is repeated until its deadline (retry.h); all calls are idempotent. Calls block. An object
// may be used from several threads at once. Errors: as Backend; and NotFound, FailedPrecondition as in
// dlcs/v1/problems.proto.
class ProblemClient {
 public:
  ProblemClient(Connection connection, Notice notice)
      : stub_(v1::ProblemService::NewStub(connection.channel())), retry_(std::move(connection), std::move(notice)) {}

  // Sends pieces below 1 MB. A server that has the problem already answers without waiting for them.
  absl::StatusOr<v1::UploadProblemResponse> Upload(const v1::ProblemBody& body, const CallLimits& limits);
  absl::StatusOr<v1::StoredProblem> Get(const std::string& name, const CallLimits& limits);
  // All pages, newest first.
  absl::StatusOr<std::vector<v1::StoredProblem>> List(const CallLimits& limits);
  absl::Status Delete(const std::string& name, const CallLimits& limits);

 private:
  std::unique_ptr<v1::ProblemService::Stub> stub_;
  Retry retry_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_PROBLEM_CLIENT_H_
