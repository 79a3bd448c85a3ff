// SPDX-License-Identifier: Apache-2.0
// One call with one answer: a gRPC reactor that hands the work to a worker thread.

#ifndef DLCS_SERVER_RPC_UNARY_CALL_H_
#define DLCS_SERVER_RPC_UNARY_CALL_H_

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "grpcpp/support/server_callback.h"
#include "server/access/audit.h"
#include "server/access/credentials.h"
#include "server/rpc/admission.h"
#include "server/rpc/call_environment.h"
#include "server/rpc/call_registry.h"

namespace dlcs {

// A call that computes takes a solver as Solve does, and its work is asked to stop when the client hangs up, the
// deadline passes or the server shuts down. Nobody reads an answer after the first two; after the third the caller gets
// UNAVAILABLE. A call about the store always runs to its end.
//
// Lives until both gRPC (OnDone) and the worker have released it.
class UnaryCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<UnaryCall> {
 public:
  // Fills the response, which is gRPC's until OnDone(), where it returns OK. Runs on a worker thread.
  using Work = std::function<absl::Status(std::stop_token stop)>;

  // `name` for the log. `environment` outlives the call.
  static grpc::ServerUnaryReactor* Start(CallEnvironment& environment, CallKind kind, const char* name, Work work);

  UnaryCall(CallEnvironment& environment, CallKind kind, const char* name, Work work)
      : environment_(environment), kind_(kind), name_(name), work_(std::move(work)) {}

  void OnCancel() override;
  void OnDone() override;

 private:
  absl::Status Admit();
  void DoWork();

  CallEnvironment& environment_;
  const CallKind kind_;
  const char* const name_;
  const Work work_;
  std::shared_ptr<UnaryCall> self_;        // gRPC's share
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  Admission::Ticket solver_;
};

// A call that computes: `run(stop)` returns a StatusOr of the response.
template <typename Response, typename Run>
grpc::ServerUnaryReactor* Compute(CallEnvironment& environment, const char* name, Response& response, Run run) {
  return UnaryCall::Start(environment, CallKind::kCompute, name,
                          [&response, run = std::move(run)](std::stop_token stop) -> absl::Status {
                            absl::StatusOr<Response> result = run(std::move(stop));
                            if (!result.ok()) return result.status();
                            response = *std::move(result);
                            return absl::OkStatus();
                          });
}

// A call about the store: `run(caller)` returns a StatusOr of the response.
template <typename Response, typename Run>
grpc::ServerUnaryReactor* AskStore(CallEnvironment& environment, const grpc::CallbackServerContext& context,
                                   const char* name, Response& response, Run run) {
  return UnaryCall::Start(environment, CallKind::kStore, name,
                          [&response, run = std::move(run), caller = CallerOf(environment.access, context)](
                              const std::stop_token& /*stop*/) -> absl::Status {
                            if (!caller.ok()) return caller.status();
                            absl::StatusOr<Response> result = run(*caller);
                            if (!result.ok()) return result.status();
                            response = *std::move(result);
                            return absl::OkStatus();
                          });
}

// `run(caller)`, with its outcome in the log: for calls that change something. `request` outlives the call.
template <typename Request, typename Run>
auto Audited(const char* method, const Request& request, Run run) {
  return [method, &request, run = std::move(run)](const Caller& caller) {
    auto result = run(caller);
    std::string object;
    if constexpr (requires { request.name(); }) {
      object = request.name();
    } else if (result.ok()) {
      if constexpr (requires { result->name(); }) {
        object = result->name();
      } else {
        object = result->job();
      }
    }
    Audit({.user = caller.user,
           .method = method,
           .object = object,
           .outcome = result.status().code(),
           .peer = caller.peer});
    return result;
  };
}

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_UNARY_CALL_H_
