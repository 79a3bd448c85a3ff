// SPDX-License-Identifier: Apache-2.0
// The RPC methods of dlcs.v1.JobService.

#ifndef DLCS_SERVER_RPC_JOB_SERVICE_H_
#define DLCS_SERVER_RPC_JOB_SERVICE_H_

#include <chrono>
#include <memory>
#include <string>

#include "core/setup_cache.h"
#include "dlcs/v1/jobs.grpc.pb.h"
#include "server/access/access.h"
#include "server/access/user_quota.h"
#include "server/config/server_config.h"
#include "server/jobs/job_manager.h"
#include "server/rpc/call_registry.h"
#include "server/rpc/job_calls.h"
#include "server/rpc/worker_pool.h"
#include "server/solve_jobs/job_solver.h"
#include "server/solve_jobs/problem_library.h"
#include "server/store/open_store.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

// The store, the manager and what calls about jobs share. Destroy after the gRPC server that uses it.
class JobService final : public v1::JobService::CallbackService {
 public:
  // `config` is valid, resolved, and names a store. Takes up at once the jobs that are there.
  // `access` says whose jobs a caller sees; it and `metrics` outlive the service.
  JobService(const ServerConfig& config, const Access& access, Metrics& metrics);

  grpc::ServerUnaryReactor* CreateSolveJob(grpc::CallbackServerContext* context,
                                           const v1::CreateSolveJobRequest* request, v1::SolveJob* response) override;
  grpc::ServerUnaryReactor* GetSolveJob(grpc::CallbackServerContext* context, const v1::GetSolveJobRequest* request,
                                        v1::SolveJob* response) override;
  grpc::ServerUnaryReactor* ListSolveJobs(grpc::CallbackServerContext* context, const v1::ListSolveJobsRequest* request,
                                          v1::ListSolveJobsResponse* response) override;
  grpc::ServerUnaryReactor* CancelSolveJob(grpc::CallbackServerContext* context,
                                           const v1::CancelSolveJobRequest* request, v1::SolveJob* response) override;
  grpc::ServerUnaryReactor* DeleteSolveJob(grpc::CallbackServerContext* context,
                                           const v1::DeleteSolveJobRequest* request,
                                           v1::DeleteSolveJobResponse* response) override;
  grpc::ServerWriteReactor<v1::JobEvent>* WatchSolveJob(grpc::CallbackServerContext* context,
                                                        const v1::WatchSolveJobRequest* request) override;
  grpc::ServerWriteReactor<v1::TrajectoryPage>* ReadTrajectory(grpc::CallbackServerContext* context,
                                                               const v1::ReadTrajectoryRequest* request) override;

  // A solve that is a job: SolverService::Solve with a request_id.
  grpc::ServerWriteReactor<v1::SolveEvent>* Solve(grpc::CallbackServerContext& context,
                                                  const v1::SolveRequest& request);

  // Uploaded problems, which jobs name.
  const ProblemLibrary& library() const { return library_; }
  const jobs::JobManagerOptions& options() const { return manager_.options(); }
  const JobCallEnvironment& environment() const { return environment_; }

  // The store answers, and nobody drains.
  bool Healthy() const { return manager_.Healthy(); }
  ServerState::Jobs State() const { return {manager_.load(), setups_.statistics(), store_->Healthy()}; }

  // From now on new calls get UNAVAILABLE, and so do watchers and readers: they go on at the next server.
  void Drain();
  // Then: running jobs may end within `grace`; the others are given back to the store with what was found. Nothing runs
  // when it returns.
  void Stop(std::chrono::milliseconds grace);
  // False when calls are still under way after `timeout`.
  bool WaitUntilIdle(std::chrono::milliseconds timeout) { return calls_.WaitUntilIdle(timeout); }

 private:
  // A copy of the request, which may be large: it is made into the body of the job.
  absl::StatusOr<v1::SolveJob> Create(const Caller& caller, v1::CreateSolveJobRequest request,
                                      const std::string& trace_id);
  absl::StatusOr<v1::Accepted> CreateForSolve(const Caller& caller, const v1::SolveRequest& request,
                                              std::chrono::system_clock::time_point deadline,
                                              const std::string& trace_id);
  absl::StatusOr<v1::SolveJob> Get(const Caller& caller, const v1::GetSolveJobRequest& request);
  absl::StatusOr<v1::ListSolveJobsResponse> List(const Caller& caller, const v1::ListSolveJobsRequest& request);
  absl::StatusOr<v1::SolveJob> Cancel(const Caller& caller, const v1::CancelSolveJobRequest& request);
  absl::StatusOr<v1::DeleteSolveJobResponse> Delete(const Caller& caller, const v1::DeleteSolveJobRequest& request);

  UserQuota watches_;
  CallRegistry calls_;
  SetupCache setups_;
  const std::unique_ptr<jobs::Store> store_;
  const ProblemLibrary library_;
  JobSolver solver_;
  jobs::JobManager manager_;
  WorkerPool workers_;  // its threads, which use the others, are joined first
  const JobCallEnvironment environment_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_JOB_SERVICE_H_
