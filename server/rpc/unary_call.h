// SPDX-License-Identifier: Apache-2.0
// A unary call: a gRPC reactor that runs its work on a worker thread.

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

// A kCompute call takes a solver as Solve does. Its work is stopped when the client disconnects, the deadline passes or
// the server shuts down; in the last case the caller gets UNAVAILABLE. A kStore call always runs to its end.
//
// Lives until both gRPC (OnDone) and the worker have released it.
class UnaryCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<UnaryCall> {
 public:
  // Runs on a worker thread. If it returns OK it has filled the response, which is owned by gRPC and valid until
  // OnDone().
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
  std::shared_ptr<UnaryCall> self_;        // the reference that gRPC holds
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  Admission::Ticket solver_;
};

// A kCompute call: `run(stop)` returns a StatusOr of the response.
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

// A kStore call: `run(caller)` returns a StatusOr of the response.
template <typename Response, typename Run>
grpc::ServerUnaryReactor* CallStore(CallEnvironment& environment, const grpc::CallbackServerContext& context,
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

// Calls `run(caller)` and logs its outcome, for methods that change stored data. `request` must outlive the call.
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
