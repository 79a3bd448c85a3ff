// SPDX-License-Identifier: Apache-2.0
// The RPC methods of dlcs.v1.ProblemService.

#ifndef DLCS_SERVER_RPC_PROBLEM_SERVICE_H_
#define DLCS_SERVER_RPC_PROBLEM_SERVICE_H_

#include "dlcs/v1/problems.grpc.pb.h"
#include "server/rpc/call_environment.h"
#include "server/rpc/upload_call.h"

namespace dlcs {

class ProblemService final : public v1::ProblemService::CallbackService {
 public:
  // `environment` has a job backend and must outlive the service.
  explicit ProblemService(CallEnvironment& environment)
      : environment_(environment), library_(environment.jobs->library()) {}

  grpc::ServerReadReactor<v1::UploadProblemRequest>* UploadProblem(grpc::CallbackServerContext* context,
                                                                   v1::UploadProblemResponse* response) override;
  grpc::ServerUnaryReactor* CreateProblem(grpc::CallbackServerContext* context, const v1::CreateProblemRequest* request,
                                          v1::StoredProblem* response) override;
  grpc::ServerUnaryReactor* GetProblem(grpc::CallbackServerContext* context, const v1::GetProblemRequest* request,
                                       v1::StoredProblem* response) override;
  grpc::ServerUnaryReactor* ListProblems(grpc::CallbackServerContext* context, const v1::ListProblemsRequest* request,
                                         v1::ListProblemsResponse* response) override;
  grpc::ServerUnaryReactor* DeleteProblem(grpc::CallbackServerContext* context, const v1::DeleteProblemRequest* request,
                                          v1::DeleteProblemResponse* response) override;

 private:
  CallEnvironment& environment_;
  const ProblemLibrary& library_;
  UploadSlots slots_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_PROBLEM_SERVICE_H_
