// SPDX-License-Identifier: Apache-2.0
#include "server/solver_service.h"

#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "core/solution.h"
#include "server/convert.h"
#include "server/errors.h"
#include "server/guarded.h"
#include "server/status.h"
#include "server/version.h"

namespace dlcs {
namespace {

const char* Describe(Method method) {
  switch (method) {
    case Method::kAuto:
      return "chosen from the class of M, with the reason";
    case Method::kLaplaceIteration:
      return "Wu & Chen's iteration in reduced space, windowed and parallel over time points; order 2; M a "
             "P- or "
             "Z-matrix";
    case Method::kPaperIteration:
      return "Wu & Chen's iteration exactly as printed, one contour per time point; A sectorial, modest "
             "numbers "
             "of steps";
    case Method::kExponentialMarch:
      return "the same fixed point marched step by step; order 2 where y is Lipschitz, otherwise order 1";
    case Method::kTimeStepping:
      return "theta scheme by substitution, projects inconsistent states; order 1; any class of M";
  }
  return "";
}

}  // namespace

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
        Guarded("lcp", [&] { return RunLcp(*request, environment_.limits); });
    if (result.ok()) *response = *std::move(result);
    solver.reset();
    reactor->Finish(ToGrpc(result.status()));
  });
  return reactor;
}

grpc::ServerUnaryReactor* SolverService::GetCapabilities(grpc::CallbackServerContext* context,
                                                         const v1::GetCapabilitiesRequest*,
                                                         v1::GetCapabilitiesResponse* response) {
  response->set_version(kVersion);
  for (const Method method : {Method::kAuto, Method::kLaplaceIteration, Method::kPaperIteration,
                              Method::kExponentialMarch, Method::kTimeStepping}) {
    auto& info = *response->add_methods();
    info.set_method(ToProto(method));
    info.set_name(MethodName(method));
    info.set_description(Describe(method));
  }
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
