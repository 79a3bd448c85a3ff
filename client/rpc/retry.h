// SPDX-License-Identifier: Apache-2.0
// Calls that outlast cuts of the connection and restarts of the server.

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

// Told of every repetition: what happened, and when it goes on. Must not throw.
using Notice = std::function<void(const std::string& text)>;

// Where no answer comes (UNAVAILABLE, a cut stream), a call is repeated after 0.1 s, 0.2 s, ... at most 5 s, and when
// there is a connection again, for which it waits as long once more, until its deadline; what RetryInfo asks for is
// kept to, and what will not pass by itself (a wrong certificate) ends it. Before the first answer of a server a second
// of that is all, unless the options of the connection say otherwise. For calls of which a repetition does nothing
// twice. May be used from several threads at once.
class Retry {
 public:
  // `notice` may be empty.
  Retry(Connection connection, Notice notice) : connection_(std::move(connection)), notice_(std::move(notice)) {}

  const Connection& connection() const { return connection_; }

  // One attempt, within the time that is left. Sets `made_progress` where it brought something: then pauses begin small
  // again.
  using Attempt = std::function<grpc::Status(const CallLimits& left, bool& made_progress)>;
  // `attempt` until it succeeds, fails for good, or the time is over. Errors: as Connection::Describe().
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

// 128 random bits in hex: a request_id that nobody else has.
std::string NewRequestId();

// Whether another attempt may succeed: for a call that is repeated in a way of its own.
bool IsTransient(const grpc::Status& status);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_RETRY_H_
