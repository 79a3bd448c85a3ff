// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/problem_service.h"

#include "server/access/credentials.h"
#include "server/rpc/unary_call.h"

namespace dlcs {

grpc::ServerReadReactor<v1::UploadProblemRequest>* ProblemService::UploadProblem(grpc::CallbackServerContext* context,
                                                                                 v1::UploadProblemResponse* response) {
  return UploadCall::Start(environment_, slots_, CallerOf(environment_.access, *context), *response);
}

grpc::ServerUnaryReactor* ProblemService::CreateProblem(grpc::CallbackServerContext* context,
                                                        const v1::CreateProblemRequest* request,
                                                        v1::StoredProblem* response) {
  const auto run = [=, this](const Caller& caller) -> absl::StatusOr<v1::StoredProblem> {
    const UploadSlot slot(slots_);
    if (!slot.is_free()) return UploadSlot::AllTaken();
    return library_.Create(caller.user, *request);
  };
  return CallStore(environment_, *context, "create problem", *response, Audited("CreateProblem", *request, run));
}

grpc::ServerUnaryReactor* ProblemService::GetProblem(grpc::CallbackServerContext* context,
                                                     const v1::GetProblemRequest* request,
                                                     v1::StoredProblem* response) {
  return CallStore(environment_, *context, "get problem", *response,
                   [=, this](const Caller& caller) { return library_.Get(caller.user, *request); });
}

grpc::ServerUnaryReactor* ProblemService::ListProblems(grpc::CallbackServerContext* context,
                                                       const v1::ListProblemsRequest* request,
                                                       v1::ListProblemsResponse* response) {
  return CallStore(environment_, *context, "list problems", *response,
                   [=, this](const Caller& caller) { return library_.List(caller.user, *request); });
}

grpc::ServerUnaryReactor* ProblemService::DeleteProblem(grpc::CallbackServerContext* context,
                                                        const v1::DeleteProblemRequest* request,
                                                        v1::DeleteProblemResponse* response) {
  const auto run = [=, this](const Caller& caller) -> absl::StatusOr<v1::DeleteProblemResponse> {
    const absl::Status deleted = library_.Delete(caller.user, *request);
    if (!deleted.ok()) return deleted;
    return v1::DeleteProblemResponse();
  };
  return CallStore(environment_, *context, "delete problem", *response, Audited("DeleteProblem", *request, run));
}

}  // namespace dlcs
