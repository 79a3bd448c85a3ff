// SPDX-License-Identifier: Apache-2.0
#include "server/problem_service.h"

namespace dlcs {

grpc::ServerReadReactor<v1::UploadProblemRequest>* ProblemService::UploadProblem(grpc::CallbackServerContext*,
                                                                                 v1::UploadProblemResponse* response) {
  return UploadCall::Start(environment_, places_, Upload(library_, kSharedOwner), *response);
}

grpc::ServerUnaryReactor* ProblemService::GetProblem(grpc::CallbackServerContext*, const v1::GetProblemRequest* request,
                                                     v1::StoredProblem* response) {
  return Answer(environment_, "get problem", *response, [=, this] { return library_.Get(kSharedOwner, *request); });
}

grpc::ServerUnaryReactor* ProblemService::ListProblems(grpc::CallbackServerContext*,
                                                       const v1::ListProblemsRequest* request,
                                                       v1::ListProblemsResponse* response) {
  return Answer(environment_, "list problems", *response, [=, this] { return library_.List(kSharedOwner, *request); });
}

grpc::ServerUnaryReactor* ProblemService::DeleteProblem(grpc::CallbackServerContext*,
                                                        const v1::DeleteProblemRequest* request,
                                                        v1::DeleteProblemResponse*) {
  return JobCall::Start(environment_, "delete problem", [=, this] { return library_.Delete(kSharedOwner, *request); });
}

}  // namespace dlcs
