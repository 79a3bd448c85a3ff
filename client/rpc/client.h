// SPDX-License-Identifier: Apache-2.0
// The service's client.
//
//     auto client = dlcs::client::Client::Connect("localhost:50051");     // or with ConnectionOptions
//     auto result = (*client)->Solve(request, [](const dlcs::v1::SolveEvent& event) { ... }, {});

#ifndef DLCS_CLIENT_RPC_CLIENT_H_
#define DLCS_CLIENT_RPC_CLIENT_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/result/backend.h"
#include "client/rpc/connection.h"
#include "client/rpc/job_client.h"
#include "client/rpc/problem_client.h"
#include "dlcs/v1/solver.grpc.pb.h"

namespace dlcs::client {

class Client final : public Backend {
 public:
  // The connection is made by the first call, which fails if no server answers. `notice`, which may be empty, is called
  // when a solve is resumed after a lost connection. Errors: as Connection::Open().
  static absl::StatusOr<std::unique_ptr<Client>> Connect(const ConnectionOptions& options, Notice notice = {});

  // A solve with a request_id runs as a job if the server has jobs. It survives lost connections and server restarts:
  // the client reconnects and follows the job to its end, and deletes the job after receiving the result. `limits.stop`
  // cancels the job; the result is then the part solved so far, and the job is kept.

  absl::StatusOr<SolveResult> Solve(const v1::SolveRequest& request, const EventCallback& on_event,
                                    const CallLimits& limits) override;
  absl::StatusOr<v1::EnsembleSummary> SolveEnsemble(const v1::SolveEnsembleRequest& request,
                                                    const MemberCallback& on_member, const CallLimits& limits) override;
  absl::StatusOr<v1::SolveLcpResponse> SolveLcp(const v1::SolveLcpRequest& request, const CallLimits& limits) override;
  absl::StatusOr<v1::SolveDcpResponse> SolveDcp(const v1::SolveDcpRequest& request, const CallLimits& limits) override;
  absl::StatusOr<v1::AnalyzeProblemResponse> AnalyzeProblem(const v1::AnalyzeProblemRequest& request,
                                                            const CallLimits& limits) override;
  absl::StatusOr<v1::GetCapabilitiesResponse> GetCapabilities(const CallLimits& limits) override;

  // What works on jobs and on uploaded problems, through the same connection; they live as long as this does.
  JobClient& jobs() { return jobs_; }
  ProblemClient& problems() { return problems_; }

 private:
  Client(Connection connection, Notice notice);

  template <typename Request, typename Response>
  using UnaryMethod = grpc::Status (v1::SolverService::Stub::*)(grpc::ClientContext*, const Request&, Response*);
  template <typename Request, typename Response>
  absl::StatusOr<Response> Ask(UnaryMethod<Request, Response> method, const Request& request, const CallLimits& limits);

  const Connection connection_;
  const std::unique_ptr<v1::SolverService::Stub> stub_;
  const Notice notice_;
  JobClient jobs_;
  ProblemClient problems_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_CLIENT_H_
