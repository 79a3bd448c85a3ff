// SPDX-License-Identifier: Apache-2.0
// The connection to a server, and what every call on it carries.

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

// May be used from several threads at once.
class Connection {
 public:
  // The connection is made by the first call. Errors: InvalidArgument with the field of `options` and the rule, where
  // the address is not HOST:PORT, a file cannot be used, or the token would travel without encryption.
  static absl::StatusOr<Connection> Open(const ConnectionOptions& options);

  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  const ConnectionOptions& options() const { return options_; }

  // Whether `status` is of the server and not of the way to it.
  static bool IsAnswer(const grpc::Status& status);
  // Of all copies of this connection: something came from the server.
  void NoteAnswer() const { answered_->store(true); }
  bool has_answered() const { return answered_->load(); }

  // A call that failed, in words. Where no server answers it may connect once more to find out why.
  absl::Status Describe(const grpc::Status& status) const;
  // What stands between both ends and will not pass by itself; nothing where another attempt may succeed.
  std::optional<absl::Status> PermanentFailure(const grpc::Status& status) const;

 private:
  Connection(ConnectionOptions options, std::shared_ptr<grpc::Channel> channel);

  ConnectionOptions options_;
  std::shared_ptr<grpc::Channel> channel_;
  std::shared_ptr<std::atomic<bool>> answered_ = std::make_shared<std::atomic<bool>>(false);
};

// The trace, a token where there is one, a deadline, and a way to be cancelled while the call runs.
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
