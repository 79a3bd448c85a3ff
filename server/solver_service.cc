// SPDX-License-Identifier: Apache-2.0
#include "server/solver_service.h"

#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "server/analyze_call.h"
#include "server/capabilities.h"
#include "server/errors.h"
#include "server/guarded.h"
#include "server/status.h"

namespace dlcs {
SolverService::SolverService(const ServerConfig& config)
    : config_(config),
      admission_(config.max_concurrent_solves, config.max_held_result_bytes),
      environment_{LimitsOf(config), admission_, workers_, calls_},
      workers_(config.max_concurrent_solves) {}

grpc::ServerWriteReactor<v1::SolveEvent>* SolverService::Solve(grpc::CallbackServerContext* context,
                                                               const v1::SolveRequest* request) {
  return SolveCall::Start(environment_, *context, *request);
}

grpc::ServerUnaryReactor* SolverService::SolveLcp(grpc::CallbackServerContext* context,
                                                  const v1::SolveLcpRequest* request,
                                                  v1::SolveLcpResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  std::shared_ptr<SolveControl> control = calls_.Register();
  if (control == nullptr) {
    reactor->Finish(ToGrpc(ShuttingDown()));
    return reactor;
  }
  absl::StatusOr<Admission::Ticket> solver = admission_.TakeSolver();
  if (!solver.ok()) {
    reactor->Finish(ToGrpc(solver.status()));
    return reactor;
  }
  workers_.Run([this, reactor, request, response, control = std::move(control),
                solver = *std::move(solver)]() mutable {
    absl::StatusOr<v1::SolveLcpResponse> result =
        Guarded("lcp", [&] { return RunLcp(*request, environment_.limits, control->token()); });
    if (result.ok()) *response = *std::move(result);
    solver.reset();
    reactor->Finish(ToGrpc(result.status()));
  });
  return reactor;
}

grpc::ServerUnaryReactor* SolverService::AnalyzeProblem(grpc::CallbackServerContext*,
                                                        const v1::AnalyzeProblemRequest* request,
                                                        v1::AnalyzeProblemResponse* response) {
  return AnalyzeCall::Start(environment_, *request, *response);
}

grpc::ServerUnaryReactor* SolverService::GetCapabilities(grpc::CallbackServerContext* context,
                                                         const v1::GetCapabilitiesRequest*,
                                                         v1::GetCapabilitiesResponse* response) {
  *response = CommonCapabilities();
  response->set_max_states(config_.max_states);
  response->set_max_constraints(config_.max_constraints);
  response->set_max_steps(config_.max_steps);
  response->set_max_result_bytes(config_.max_result_bytes);
  response->set_max_message_bytes(config_.max_message_bytes);
  response->set_max_concurrent_solves(config_.max_concurrent_solves);
  response->set_threads(config_.threads);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace dlcs
