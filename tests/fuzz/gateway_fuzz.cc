// SPDX-License-Identifier: Apache-2.0
// Requests to the web port, as text: request line, headers and body are converted to a gRPC call.
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "boost/asio/buffer.hpp"
#include "boost/beast/http/parser.hpp"
#include "boost/beast/http/string_body.hpp"
#include "dlcs/v1/jobs.pb.h"
#include "dlcs/v1/problems.pb.h"
#include "dlcs/v1/solver.pb.h"
#include "google/protobuf/message.h"
#include "google/protobuf/util/message_differencer.h"
#include "grpc/grpc.h"
#include "grpc/slice.h"
#include "grpcpp/support/status.h"
#include "nlohmann/json.hpp"
#include "server/access/forwarded_caller.h"
#include "server/gateway/json_message.h"
#include "server/gateway/own_hosts.h"
#include "server/gateway/rpc_format.h"
#include "server/gateway/rpc_gateway.h"
#include "server/http/http_message.h"
#include "server/wire/status.h"
#include "tests/fuzz/fuzz_target.h"

namespace dlcs::fuzz {
namespace {

namespace beast_http = boost::beast::http;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using Json = nlohmann::json;

struct ParsedRequest {
  HttpRequest request;
  std::string body;
};

// As the server reads a connection.
std::optional<ParsedRequest> ReadRequest(const std::string& input) {
  beast_http::request_parser<beast_http::string_body> parser;
  parser.header_limit(16 << 10);
  parser.body_limit(64 << 10);
  boost::system::error_code error;
  boost::asio::const_buffer rest(input.data(), input.size());
  while (rest.size() > 0 && !parser.is_done() && !error) rest += parser.put(rest, error);
  if (!parser.is_header_done() || AmbiguityOf(parser.get()) != nullptr) return std::nullopt;
  const auto& headers = parser.get();
  Require(headers.count(beast_http::field::host) <= 1, "no two hosts pass");
  Require(headers.count(beast_http::field::transfer_encoding) == 0 || parser.chunked(), "codings are chunks");
  Require(!parser.chunked() || !parser.content_length(), "no two lengths pass");
  ParsedRequest read;
  SetHead(parser.get(), read.request);
  read.body = std::move(parser.get().body());
  return read;
}

void TryHost(std::string_view authority) {
  const std::string host = HostIn(authority);
  Require(host.find_first_of("/@ []") == std::string::npos, "a host is a name or an address");
  const OwnHosts hosts({"example.org"});
  Require(!hosts.Has(authority) || !host.ends_with(".com"), "other hosts are not ours");
}

// The error as a client receives it.
void TryStatus(const RpcFormat& format, const absl::Status& error) {
  Require(!error.message().empty(), "a refusal says why");
  const grpc::Status status = ToGrpc(error);
  Require(!Json::parse(ErrorResponse(status).body, nullptr, false).is_discarded(), "an error is JSON");
  std::string end = FrameEnd(format, status, {{"key", "value"}});
  if (format.protocol == RpcProtocol::kJsonLines) {
    Require(end.ends_with('\n') && !Json::parse(end, nullptr, false).is_discarded(), "an error is a line of JSON");
  } else if (format.protocol != RpcProtocol::kConnectUnary) {
    Require(!end.empty(), "a stream has an end");
    Require(SplitBody(format, std::move(end)).value_or(std::vector<std::string>{""}).empty(), "which is no message");
  }
}

// gRPC ends the process for metadata that it does not accept.
void TryMetadata(const std::vector<std::pair<std::string, std::string>>& metadata) {
  for (const auto& [key, value] : metadata) {
    Require(key != kForwardedCaller, "nobody forges a caller");
    const grpc_slice name = grpc_slice_from_copied_buffer(key.data(), key.size());
    const grpc_slice text = grpc_slice_from_copied_buffer(value.data(), value.size());
    Require(grpc_header_key_is_legal(name) != 0, "a key is gRPC's");
    Require(key.ends_with("-bin") || grpc_header_nonbin_value_is_legal(text) != 0, "a value is gRPC's");
    grpc_slice_unref(name);
    grpc_slice_unref(text);
  }
}

std::unique_ptr<Message> NewMessage(const google::protobuf::Descriptor& type) {
  return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
}

void TryJson(const RpcFormat& format, const google::protobuf::Descriptor& type, const std::string& json) {
  const absl::StatusOr<std::string> bytes = JsonToMessage(type, json);
  for (const std::size_t piece : {1, 10}) {
    const absl::StatusOr<std::string> same = JsonToMessage(type, json, {.piece_bytes = piece});
    Require(same.status().code() == bytes.status().code(), "pieces do not change the outcome");
    Require(!same.ok() || *same == *bytes, "pieces do not change the message");
  }
  if (!bytes.ok()) return TryStatus(format, bytes.status());
  const auto message = NewMessage(type), again = NewMessage(type);
  Require(message->ParseFromString(*bytes), "JSON becomes a message");
  const absl::StatusOr<std::string> printed = MessageToJson(type, *bytes);
  if (!printed.ok()) return;  // what only JSON allows, such as a duration that is out of range
  const absl::StatusOr<std::string> back = JsonToMessage(type, *printed);
  Require(back.ok() && again->ParseFromString(*back), "what was printed can be read");
  Require(again->SerializeAsString() == message->SerializeAsString(), "and is the same");
}

void TryBody(const RpcFormat& format, const MethodDescriptor& method, std::string body) {
  const absl::StatusOr<std::vector<std::string>> messages = SplitBody(format, std::move(body));
  if (!messages.ok()) return TryStatus(format, messages.status());
  std::string framed;
  for (const std::string& message : *messages) {
    framed += FrameMessage(format, message);
    if (format.json) TryJson(format, *method.input_type(), message);
    // gRPC parses binary messages; only responses of the server are converted to JSON.
    if (!format.json) (void)MessageToJson(*method.output_type(), message);
  }
  // Base64 has its padding at the end of each message.
  const bool is_framed = format.protocol == RpcProtocol::kConnectStream || format.protocol == RpcProtocol::kGrpcWeb;
  if (format.base64 || !is_framed) return;
  Require(SplitBody(format, framed).value() == *messages, "framed messages are found again");
}

}  // namespace

void TryGateway(const std::string& input) {
  std::optional<ParsedRequest> read = ReadRequest(input);
  if (!read) return;
  const HttpRequest& request = read->request;
  TryHost(request.Header("host"));
  const MethodDescriptor* const method = RpcGateway::FindMethod(request.path);
  if (method == nullptr) return;
  const std::optional<RpcFormat> format = FormatOf(request.Header("content-type"), *method);
  if (!format) return;
  const auto metadata = MetadataIn(request);
  metadata.ok() ? TryMetadata(*metadata) : TryStatus(*format, metadata.status());
  const auto timeout = TimeoutOf(request, *format);
  if (!timeout.ok()) TryStatus(*format, timeout.status());
  if (timeout.ok() && *timeout) Require((*timeout)->count() >= 0, "a timeout is no time ago");
  TryBody(*format, *method, std::move(read->body));
}

}  // namespace dlcs::fuzz
