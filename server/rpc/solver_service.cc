// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/solver_service.h"

#include <memory>
#include <stop_token>
#include <utility>

#include "absl/status/statusor.h"
#include "fmt/format.h"
#include "server/access/credentials.h"
#include "server/rpc/solve_call.h"
#include "server/rpc/unary_call.h"
#include "server/session/call_session.h"
#include "server/session/capabilities.h"
#include "server/solve_jobs/job_limits.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"

namespace dlcs {

grpc::ServerWriteReactor<v1::SolveEvent>* SolverService::Solve(grpc::CallbackServerContext* context,
                                                               const v1::SolveRequest* request) {
  if (jobs_ != nullptr && !request->request_id().empty()) return jobs_->Solve(*context, *request);
  return SolveCall::Start(std::make_shared<SolveCall>(environment_, *context, *request));
}

grpc::ServerWriteReactor<v1::EnsembleEvent>* SolverService::SolveEnsemble(grpc::CallbackServerContext* context,
                                                                          const v1::SolveEnsembleRequest* request) {
  return EnsembleCall::Start(std::make_shared<EnsembleCall>(environment_, *context, *request));
}

grpc::ServerUnaryReactor* SolverService::StopSolve(grpc::CallbackServerContext* context,
                                                   const v1::StopSolveRequest* request, v1::StopSolveResponse*) {
  const auto stop = [&] {
    const absl::StatusOr<Caller> caller = CallerOf(environment_.access, *context);
    if (!caller.ok()) return caller.status();
    const bool stopped = environment_.calls.Stop(request->solve_id(), caller->SeesJobsOf(), StopCause::kCancelled);
    return stopped ? absl::OkStatus()
                   : absl::NotFoundError(fmt::format("no solve {} of yours is running here; it may have ended",
                                                     Quoted(request->solve_id())));
  };
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(ToGrpc(stop()));
  return reactor;
}

grpc::ServerUnaryReactor* SolverService::SolveLcp(grpc::CallbackServerContext*, const v1::SolveLcpRequest* request,
                                                  v1::SolveLcpResponse* response) {
  return Compute(environment_, "lcp", *response,
                 [=, this](std::stop_token stop) { return RunLcp(*request, environment_.limits, stop); });
}

grpc::ServerUnaryReactor* SolverService::SolveDcp(grpc::CallbackServerContext*, const v1::SolveDcpRequest* request,
                                                  v1::SolveDcpResponse* response) {
  return Compute(environment_, "dcp", *response,
                 [=, this](std::stop_token stop) { return RunDcp(*request, environment_.limits, stop); });
}

grpc::ServerUnaryReactor* SolverService::AnalyzeProblem(grpc::CallbackServerContext* context,
                                                        const v1::AnalyzeProblemRequest* request,
                                                        v1::AnalyzeProblemResponse* response) {
  return Compute(environment_, "analysis", *response, [=, this](std::stop_token stop) {
    return RunAnalysis(*request, environment_.limits, stop, environment_.ProblemsOf(*context));
  });
}

grpc::ServerUnaryReactor* SolverService::GetCapabilities(grpc::CallbackServerContext* context,
                                                         const v1::GetCapabilitiesRequest*,
                                                         v1::GetCapabilitiesResponse* response) {
  const ServerConfig& config = environment_.config;
  *response = CommonCapabilities();
  response->set_max_states(config.max_states);
  response->set_max_dense_states(config.max_dense_states);
  response->set_max_memory_bytes(config.max_memory_bytes);
  response->set_max_constraints(config.max_constraints);
  response->set_max_steps(config.max_steps);
  response->set_max_members(config.max_members);
  response->set_max_result_bytes(config.max_result_bytes);
  response->set_max_message_bytes(config.max_message_bytes);
  response->set_max_answer_bytes(kMaxAnswerBytes);
  response->set_max_concurrent_solves(config.max_concurrent_solves);
  response->set_threads(config.threads);
  if (jobs_ != nullptr) {
    *response->mutable_jobs() = JobLimitsToProto(environment_.jobs->manager().options(), config.max_ranks);
    *response->mutable_uploads() = UploadLimitsToProto(config);
  }
  const SetupCache::Statistics setups = environment_.SetupStatistics();
  v1::SetupCacheStatistics& statistics = *response->mutable_setup_cache();
  statistics.set_max_bytes(config.setup_cache_bytes);
  statistics.set_bytes(static_cast<std::int64_t>(setups.bytes));
  statistics.set_values(setups.values);
  statistics.set_hits(setups.hits);
  statistics.set_misses(setups.misses);
  statistics.set_dropped(setups.dropped);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace dlcs
