// SPDX-License-Identifier: Apache-2.0
// The connection to a server, and what every call on it carries.

#ifndef DLCS_CLIENT_CONNECTION_H_
#define DLCS_CLIENT_CONNECTION_H_

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "client/backend.h"

namespace dlcs::client {

// The connection is made by the first call. Errors: InvalidArgument when `address` is not HOST:PORT.
absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const std::string& address);

// A deadline, and a way to be cancelled while the call runs.
class Call {
 public:
  explicit Call(const CallLimits& limits);

  grpc::ClientContext* context() { return &context_; }

 private:
  grpc::ClientContext context_;
  std::stop_callback<std::function<void()>> cancel_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CONNECTION_H_
