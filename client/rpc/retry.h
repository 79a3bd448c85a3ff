// SPDX-License-Identifier: Apache-2.0
// Repeats calls after lost connections and server restarts.

#ifndef DLCS_CLIENT_RPC_RETRY_H_
#define DLCS_CLIENT_RPC_RETRY_H_

#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <functional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "client/result/backend.h"
#include "client/rpc/connection.h"

namespace dlcs::client {

// Called for every repetition with what happened and when the next attempt is. Must not throw.
using Notice = std::function<void(const std::string& text)>;

// A call that gets no answer (UNAVAILABLE, a broken stream) is repeated until its deadline, after pauses of 0.1 s, 0.2
// s, ... up to 5 s; each attempt waits as long again for a connection. The delay in RetryInfo is respected. Permanent
// failures (a wrong certificate) end the repetition. Before the first answer of the server it only tries for a second,
// unless the connection options say otherwise. For idempotent calls only. May be used from several threads at once.
class Retry {
 public:
  // `notice` may be empty.
  Retry(Connection connection, Notice notice) : connection_(std::move(connection)), notice_(std::move(notice)) {}

  const Connection& connection() const { return connection_; }

  // One attempt, within the remaining time. Sets `made_progress` if it received something; then pauses start at 0.1 s
  // again.
  using Attempt = std::function<grpc::Status(const CallLimits& left, bool& made_progress)>;
  // Repeats `attempt` until it succeeds, fails permanently, or the deadline passes. Errors: as Connection::Describe().
  absl::Status UntilDeadline(const CallLimits& limits, const Attempt& attempt) const;

  // The same for a call with one answer, a method of `stub`.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Ask(Stub& stub,
                               grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                               const Request& request, const CallLimits& limits) const {
    Response response;
    const absl::Status status = UntilDeadline(limits, [&](const CallLimits& left, bool&) {
      Call call(connection_, left);
      return (stub.*method)(call.context(), request, &response);
    });
    if (!status.ok()) return status;
    return response;
  }

 private:
  Connection connection_;
  Notice notice_;
};

// 128 random bits in hex, to be used as a request_id.
std::string NewRequestId();

// Whether another attempt may succeed; for calls with their own way of repetition.
bool IsTransient(const grpc::Status& status);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_RETRY_H_
