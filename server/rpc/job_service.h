// SPDX-License-Identifier: Apache-2.0
// The RPC methods of dlcs.v1.JobService.

#ifndef DLCS_SERVER_RPC_JOB_SERVICE_H_
#define DLCS_SERVER_RPC_JOB_SERVICE_H_

#include <chrono>
#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/jobs.grpc.pb.h"
#include "server/access/access.h"
#include "server/rpc/call_environment.h"
#include "server/solve_jobs/job_backend.h"

namespace dlcs {

class JobService final : public v1::JobService::CallbackService {
 public:
  // `environment` has a job backend and must outlive the service.
  explicit JobService(CallEnvironment& environment) : environment_(environment), jobs_(*environment.jobs) {}

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
  grpc::ServerWriteReactor<v1::SolveEvent>* WatchSolveJob(grpc::CallbackServerContext* context,
                                                          const v1::WatchSolveJobRequest* request) override;
  grpc::ServerWriteReactor<v1::TrajectoryPage>* ReadTrajectory(grpc::CallbackServerContext* context,
                                                               const v1::ReadTrajectoryRequest* request) override;

  grpc::ServerUnaryReactor* CreateEnsembleJob(grpc::CallbackServerContext* context,
                                              const v1::CreateEnsembleJobRequest* request,
                                              v1::SolveJob* response) override;
  grpc::ServerWriteReactor<v1::EnsemblePage>* ReadEnsemble(grpc::CallbackServerContext* context,
                                                           const v1::ReadEnsembleRequest* request) override;

  // SolverService::Solve with a request_id: the solve runs as a job.
  grpc::ServerWriteReactor<v1::SolveEvent>* Solve(grpc::CallbackServerContext& context,
                                                  const v1::SolveRequest& request);

 private:
  // Takes a copy of the request, which may be large, since it becomes the body of the job.
  absl::StatusOr<v1::SolveJob> Create(const Caller& caller, v1::CreateSolveJobRequest request,
                                      const std::string& trace_id);
  absl::StatusOr<v1::SolveJob> CreateEnsemble(const Caller& caller, v1::CreateEnsembleJobRequest request,
                                              const std::string& trace_id);
  // The job of `submission`, which is complete except for what both kinds of requests to create one have in common.
  // `trace_id` is stored with it.
  template <typename CreateRequest>
  absl::StatusOr<v1::SolveJob> Submit(const CreateRequest& request, jobs::Submission submission,
                                      const std::string& trace_id);
  absl::StatusOr<v1::Accepted> CreateForSolve(const Caller& caller, const v1::SolveRequest& request,
                                              std::chrono::system_clock::time_point deadline,
                                              const std::string& trace_id);
  // `job` as a message, with what it waits for.
  v1::SolveJob Show(const jobs::Job& job) const;
  absl::StatusOr<v1::SolveJob> Get(const Caller& caller, const v1::GetSolveJobRequest& request);
  absl::StatusOr<v1::ListSolveJobsResponse> List(const Caller& caller, const v1::ListSolveJobsRequest& request);
  absl::StatusOr<v1::SolveJob> Cancel(const Caller& caller, const v1::CancelSolveJobRequest& request);
  absl::StatusOr<v1::DeleteSolveJobResponse> Delete(const Caller& caller, const v1::DeleteSolveJobRequest& request);

  CallEnvironment& environment_;
  JobBackend& jobs_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_JOB_SERVICE_H_
