// SPDX-License-Identifier: Apache-2.0
// The connection to a server, and the metadata and deadline of every call on it.

#ifndef DLCS_CLIENT_RPC_CONNECTION_H_
#define DLCS_CLIENT_RPC_CONNECTION_H_

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "client/result/backend.h"
#include "client/rpc/connection_options.h"

namespace dlcs::client {

// Errors: InvalidArgument if `address` is neither HOST:PORT nor unix:/PATH.
absl::Status CheckAddress(const std::string& address);

// May be used from several threads at once.
class Connection {
 public:
  // The connection is made by the first call. Errors: InvalidArgument with the field of `options` and the rule, if the
  // address is not HOST:PORT, a file cannot be used, or the token would be sent without encryption.
  static absl::StatusOr<Connection> Open(const ConnectionOptions& options);

  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  const ConnectionOptions& options() const { return options_; }

  // Whether `status` comes from the server, not from the transport.
  static bool IsAnswer(const grpc::Status& status);
  // Records, for all copies of this connection, that the server has answered.
  void NoteAnswer() const { answered_->store(true); }
  bool has_answered() const { return answered_->load(); }

  // The error of a failed call, with an explanation. If no server answers, it may connect again to find the reason.
  absl::Status Describe(const grpc::Status& status) const;
  // The reason why further attempts cannot succeed either; absent if another attempt may succeed.
  std::optional<absl::Status> PermanentFailure(const grpc::Status& status) const;

 private:
  Connection(ConnectionOptions options, std::shared_ptr<grpc::Channel> channel);

  ConnectionOptions options_;
  std::shared_ptr<grpc::Channel> channel_;
  std::shared_ptr<std::atomic<bool>> answered_ = std::make_shared<std::atomic<bool>>(false);
};

// The context of one call: trace, token if there is one, deadline, and cancellation while it runs.
class Call {
 public:
  Call(const Connection& connection, const CallLimits& limits);

  grpc::ClientContext* context() { return &context_; }

 private:
  grpc::ClientContext context_;
  std::stop_callback<std::function<void()>> cancel_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_CONNECTION_H_
