// SPDX-License-Identifier: Apache-2.0
// Calls over HTTP/1.1, for browsers and scripts, forwarded to the gRPC server of this process.

#ifndef DLCS_SERVER_GATEWAY_RPC_GATEWAY_H_
#define DLCS_SERVER_GATEWAY_RPC_GATEWAY_H_

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "boost/asio/awaitable.hpp"
#include "boost/asio/thread_pool.hpp"
#include "grpcpp/channel.h"
#include "grpcpp/generic/generic_stub.h"
#include "server/access/access.h"
#include "server/gateway/forwarded_call.h"
#include "server/gateway/rpc_format.h"
#include "server/http/http_server.h"

namespace dlcs {

// Serves every method that is compiled in, in the protocols of rpc_format.h. A call has the same handler, rights,
// limits, deadline and audit line as over gRPC. Safe from any thread.
class RpcGateway {
 public:
  // `channel` leads to the server of this process. `access` must outlive the gateway.
  RpcGateway(std::shared_ptr<grpc::Channel> channel, const Access& access, std::size_t max_message_bytes);

  // Whether the path is one of a method.
  static bool IsMethod(const std::string& path);

  // Answers a POST to the path of a method (IsMethod()). Errors are answers too.
  boost::asio::awaitable<void> Answer(HttpExchange& exchange);

 private:
  boost::asio::awaitable<absl::StatusOr<ForwardedRequest>> ReadRequest(HttpExchange& exchange,
                                                                       const google::protobuf::MethodDescriptor& method,
                                                                       const RpcFormat& format);
  boost::asio::awaitable<void> AnswerUnary(HttpExchange& exchange, const google::protobuf::MethodDescriptor& method,
                                           const RpcFormat& format, ForwardedCall& call);
  boost::asio::awaitable<void> AnswerStream(HttpExchange& exchange, const google::protobuf::MethodDescriptor& method,
                                            const RpcFormat& format, ForwardedCall& call);
  boost::asio::awaitable<absl::StatusOr<std::string>> Encode(const google::protobuf::MethodDescriptor& method,
                                                             const RpcFormat& format, std::string message);

  const Access& access_;
  const std::size_t max_message_bytes_;
  grpc::GenericStub stub_;
  // Large messages are translated from and to JSON here, since that would block other connections for long.
  boost::asio::thread_pool translators_{1};
};

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_RPC_GATEWAY_H_
