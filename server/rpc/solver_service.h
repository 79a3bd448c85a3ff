// SPDX-License-Identifier: Apache-2.0
// The RPC methods of dlcs.v1.SolverService.

#ifndef DLCS_SERVER_RPC_SOLVER_SERVICE_H_
#define DLCS_SERVER_RPC_SOLVER_SERVICE_H_

#include "dlcs/v1/solver.grpc.pb.h"
#include "server/rpc/call_environment.h"
#include "server/rpc/job_service.h"

namespace dlcs {

class SolverService final : public v1::SolverService::CallbackService {
 public:
  // `jobs` handles the solves that run as jobs; null on a server without a store. Both must outlive the service.
  SolverService(CallEnvironment& environment, JobService* jobs) : environment_(environment), jobs_(jobs) {}

  grpc::ServerWriteReactor<v1::SolveEvent>* Solve(grpc::CallbackServerContext* context,
                                                  const v1::SolveRequest* request) override;
  grpc::ServerWriteReactor<v1::EnsembleEvent>* SolveEnsemble(grpc::CallbackServerContext* context,
                                                             const v1::SolveEnsembleRequest* request) override;
  grpc::ServerUnaryReactor* StopSolve(grpc::CallbackServerContext* context, const v1::StopSolveRequest* request,
                                      v1::StopSolveResponse* response) override;
  grpc::ServerUnaryReactor* SolveLcp(grpc::CallbackServerContext* context, const v1::SolveLcpRequest* request,
                                     v1::SolveLcpResponse* response) override;
  grpc::ServerUnaryReactor* SolveDcp(grpc::CallbackServerContext* context, const v1::SolveDcpRequest* request,
                                     v1::SolveDcpResponse* response) override;
  grpc::ServerUnaryReactor* AnalyzeProblem(grpc::CallbackServerContext* context,
                                           const v1::AnalyzeProblemRequest* request,
                                           v1::AnalyzeProblemResponse* response) override;
  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const v1::GetCapabilitiesRequest* request,
                                            v1::GetCapabilitiesResponse* response) override;

  // The number of running solves.
  int solves() const { return environment_.admission.solves(); }

 private:
  CallEnvironment& environment_;
  JobService* const jobs_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_SOLVER_SERVICE_H_
