// SPDX-License-Identifier: Apache-2.0
// The RPC methods of dlcs.v1.SolverService.

#ifndef DLCS_SERVER_RPC_SOLVER_SERVICE_H_
#define DLCS_SERVER_RPC_SOLVER_SERVICE_H_

#include <chrono>

#include "core/setup_cache.h"
#include "dlcs/v1/solver.grpc.pb.h"
#include "server/config/server_config.h"
#include "server/rpc/admission.h"
#include "server/rpc/call_admission.h"
#include "server/rpc/call_registry.h"
#include "server/rpc/job_service.h"
#include "server/rpc/worker_pool.h"

namespace dlcs {

// Holds what the calls share, and nothing of any one of them. Destroy after the gRPC server that uses it.
class SolverService final : public v1::SolverService::CallbackService {
 public:
  // `config` is valid and resolved; `access` and `metrics` outlive this object.
  // `jobs` takes the solves that are to be jobs, and knows the uploaded problems; null on a server without a store. It outlives
  // this object.
  SolverService(const ServerConfig& config, const Access& access, Metrics& metrics, JobService* jobs);

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

  // Refuses new calls with UNAVAILABLE from now on.
  void Drain() { calls_.Drain(); }
  // Stops all solves; each still delivers its summary.
  void StopAll() { calls_.StopAll(StopCause::kShutdown); }
  // False when calls are still under way after `timeout`.
  bool WaitUntilIdle(std::chrono::milliseconds timeout) { return calls_.WaitUntilIdle(timeout); }

  // Engines that run now.
  int solves() const { return admission_.solves(); }
  const Admission& admission() const { return admission_; }
  const SetupCache& setups() const { return setups_; }

 private:
  // A call whose `run(stop)` gives a StatusOr of the response.
  template <typename Response, typename Run>
  grpc::ServerUnaryReactor* Answer(const char* name, Response& response, Run run);

  const ServerConfig config_;
  JobService* const jobs_;
  CallRegistry calls_;
  Admission admission_;
  SetupCache setups_;
  const CallEnvironment environment_;
  WorkerPool workers_;  // last: its threads, which use the others, are joined first
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_SOLVER_SERVICE_H_
