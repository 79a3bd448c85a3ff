// SPDX-License-Identifier: Apache-2.0
// How a call looks over HTTP/1.1: the Connect protocol, gRPC-Web, and one line of JSON per event.
//
// https://connectrpc.com/docs/protocol, https://github.com/grpc/grpc/blob/master/doc/PROTOCOL-WEB.md

#ifndef DLCS_SERVER_GATEWAY_RPC_FORMAT_H_
#define DLCS_SERVER_GATEWAY_RPC_FORMAT_H_

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "google/protobuf/descriptor.h"
#include "grpcpp/support/status.h"
#include "server/http/http_message.h"

namespace dlcs {

enum class RpcProtocol {
  kConnectUnary,   // a message for a message
  kConnectStream,  // messages in envelopes; the last envelope has the status
  kGrpcWeb,        // the same with other flags, also for unary calls
  kJsonLines,      // a JSON message for a stream of lines
};

struct RpcFormat {
  RpcProtocol protocol = RpcProtocol::kConnectUnary;
  bool json = false;         // messages are JSON, and not protobuf
  bool base64 = false;       // gRPC-Web's text form
  std::string content_type;  // of the response
};

// The format of a request for `method` with this content type; absent for a type that is not served (415).
std::optional<RpcFormat> FormatOf(std::string_view content_type, const google::protobuf::MethodDescriptor& method);

// The messages in the body of a request. Errors: InvalidArgument for a broken body; Unimplemented for compression.
absl::StatusOr<std::vector<std::string>> SplitBody(const RpcFormat& format, std::string body);

// A message of the response as it is sent.
std::string FrameMessage(const RpcFormat& format, std::string message);

using RpcTrailers = std::multimap<std::string, std::string>;

// What follows the messages of a stream: the status, and for Connect and gRPC-Web the trailing metadata. Empty where
// nothing follows.
std::string FrameEnd(const RpcFormat& format, const grpc::Status& status, const RpcTrailers& trailers);

// A status other than OK of a call that sent no message, for Connect's unary calls and JSON lines.
HttpResponse ErrorResponse(const grpc::Status& status);

// Trailing metadata of Connect's unary calls: "trailer-KEY".
HttpHeaders UnaryTrailers(const RpcTrailers& trailers);

// The timeout that a request asks for in "connect-timeout-ms" or "grpc-timeout"; absent for none. Errors:
// InvalidArgument.
absl::StatusOr<std::optional<std::chrono::nanoseconds>> TimeoutOf(const HttpRequest& request, const RpcFormat& format);

// The headers of a request that are metadata of the call. Errors: InvalidArgument for broken base64; PermissionDenied
// for metadata that is reserved for the server.
absl::StatusOr<std::vector<std::pair<std::string, std::string>>> MetadataIn(const HttpRequest& request);

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_RPC_FORMAT_H_
