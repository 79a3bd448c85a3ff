// SPDX-License-Identifier: Apache-2.0
// Calls over HTTP/1.1, for browsers and scripts, forwarded to the gRPC server of this process.

#ifndef DLCS_SERVER_GATEWAY_RPC_GATEWAY_H_
#define DLCS_SERVER_GATEWAY_RPC_GATEWAY_H_

#include <cstddef>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "boost/asio/awaitable.hpp"
#include "grpcpp/channel.h"
#include "grpcpp/generic/generic_stub.h"
#include "server/access/access.h"
#include "server/gateway/forwarded_call.h"
#include "server/gateway/rpc_format.h"
#include "server/gateway/transcoder_pool.h"
#include "server/http/http_server.h"

namespace dlcs {

// Serves every method that is compiled in, in the protocols of rpc_format.h. A call has the same handler, rights,
// limits, deadline and audit line as over gRPC. Safe from any thread.
class RpcGateway {
 public:
  // `channel` leads to the server of this process. `access` must outlive the gateway.
  RpcGateway(std::shared_ptr<grpc::Channel> channel, const Access& access, std::size_t max_message_bytes);

  // "/dlcs.v1.SolverService/Solve"; null if there is no such method.
  static const google::protobuf::MethodDescriptor* FindMethod(const std::string& path);
  // The paths of all methods of the contract, proto/dlcs/v1.
  static std::vector<std::string> MethodPaths();

  // Answers a POST to the path of a method. Errors are answers too.
  boost::asio::awaitable<void> Answer(HttpExchange& exchange);

 private:
  boost::asio::awaitable<absl::StatusOr<ForwardedRequest>> ReadRequest(HttpExchange& exchange,
                                                                       const google::protobuf::MethodDescriptor& method,
                                                                       const RpcFormat& format);
  boost::asio::awaitable<void> AnswerUnary(HttpExchange& exchange, const google::protobuf::MethodDescriptor& method,
                                           const RpcFormat& format, ForwardedCall& call);
  boost::asio::awaitable<void> AnswerStream(HttpExchange& exchange, const google::protobuf::MethodDescriptor& method,
                                            const RpcFormat& format, ForwardedCall& call);
  // Runs `work` at once for a small message, and on another thread for a large one.
  boost::asio::awaitable<absl::StatusOr<std::string>> Transcode(HttpExchange& exchange, std::size_t bytes,
                                                                std::stop_token disconnected,
                                                                TranscoderPool::Work work);
  boost::asio::awaitable<absl::StatusOr<std::string>> Encode(HttpExchange& exchange,
                                                             const google::protobuf::MethodDescriptor& method,
                                                             const RpcFormat& format, std::string message);

  const Access& access_;
  const std::size_t max_message_bytes_;
  grpc::GenericStub stub_;
  TranscoderPool transcoders_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_RPC_GATEWAY_H_
