// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/rpc_gateway.h"

#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "dlcs/v1/jobs.pb.h"
#include "dlcs/v1/problems.pb.h"
#include "dlcs/v1/solver.pb.h"
#include "fmt/format.h"
#include "google/protobuf/descriptor.h"
#include "server/gateway/forwarded_call.h"
#include "server/gateway/json_message.h"
#include "server/wire/status.h"

namespace dlcs {
namespace {

namespace asio = boost::asio;
using google::protobuf::MethodDescriptor;

// Converting a message of this size takes about a millisecond.
constexpr std::size_t kLargeBytes = 64 << 10;

// Sends the status of a call that has sent no message.
asio::awaitable<void> ReplyError(HttpExchange& exchange, const RpcFormat& format, grpc::Status status) {
  HttpResponse response;
  if (format.protocol == RpcProtocol::kConnectStream || format.protocol == RpcProtocol::kGrpcWeb) {
    response.headers = {{"content-type", format.content_type}};
    response.body = FrameEnd(format, status, {});
  } else {
    response = ErrorResponse(status);
  }
  response.headers.emplace_back("cache-control", "no-store");
  co_await exchange.Reply(std::move(response));
}

// The end of a call. For bytes that are not a message of the method, gRPC reports only UNIMPLEMENTED.
asio::awaitable<grpc::Status> EndOf(ForwardedCall& call, const MethodDescriptor& method) {
  grpc::Status status = co_await call.Finish();
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED && status.error_message().empty()) {
    status = ToGrpc(
        absl::InvalidArgumentError(fmt::format("the body is not a message {}", method.input_type()->full_name())));
  }
  co_return status;
}

}  // namespace

RpcGateway::RpcGateway(std::shared_ptr<grpc::Channel> channel, const Access& access, std::size_t max_message_bytes)
    : access_(access), max_message_bytes_(max_message_bytes), stub_(std::move(channel)) {}

const MethodDescriptor* RpcGateway::FindMethod(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (path.empty() || path[0] != '/' || slash == 0 || slash == std::string::npos) return nullptr;
  const auto* const pool = google::protobuf::DescriptorPool::generated_pool();
  const auto* const service = pool->FindServiceByName(path.substr(1, slash - 1));
  return service == nullptr ? nullptr : service->FindMethodByName(path.substr(slash + 1));
}

std::vector<std::string> RpcGateway::MethodPaths() {
  std::vector<std::string> paths;
  // Of every file of the contract one message.
  for (const auto* const message :
       {v1::SolveRequest::descriptor(), v1::SolveJob::descriptor(), v1::StoredProblem::descriptor()}) {
    const google::protobuf::FileDescriptor& file = *message->file();
    for (int k = 0; k < file.service_count(); ++k) {
      const google::protobuf::ServiceDescriptor& service = *file.service(k);
      for (int method = 0; method < service.method_count(); ++method) {
        paths.push_back("/" + service.full_name() + "/" + service.method(method)->name());
      }
    }
  }
  return paths;
}

asio::awaitable<void> RpcGateway::Answer(HttpExchange& exchange) {
  const HttpRequest& request = exchange.request();
  const MethodDescriptor* const method = FindMethod(request.path);
  const std::optional<RpcFormat> format = FormatOf(request.Header("content-type"), *method);
  if (!format) {
    const bool unary = !method->client_streaming() && !method->server_streaming();
    std::string types =
        unary ? "application/json, application/proto" : "application/connect+json, application/connect+proto";
    if (!unary && !method->client_streaming()) types = "application/json, " + types;
    if (!method->client_streaming()) types += ", application/grpc-web+proto, application/grpc-web-text+proto";
    HttpResponse refusal =
        TextResponse(415, fmt::format("content type \"{}\" is not served here; use one of {}\n",
                                      std::string(request.Header("content-type").substr(0, 100)), types));
    refusal.headers.emplace_back("accept-post", types);
    co_await exchange.Reply(std::move(refusal));
    co_return;
  }
  absl::StatusOr<ForwardedRequest> forwarded = co_await ReadRequest(exchange, *method, *format);
  if (!forwarded.ok()) {
    const grpc::Status status = ToGrpc(forwarded.status());
    co_await ReplyError(exchange, *format, status);
    co_return;
  }
  const std::shared_ptr<ForwardedCall> call = ForwardedCall::Start(stub_, *std::move(forwarded), exchange.executor());
  std::function<void()> cancel = [weak = std::weak_ptr(call)] {
    if (const auto alive = weak.lock()) alive->Cancel();
  };
  exchange.OnDisconnect(std::move(cancel));
  if (format->protocol == RpcProtocol::kConnectUnary) {
    co_await AnswerUnary(exchange, *method, *format, *call);
  } else {
    co_await AnswerStream(exchange, *method, *format, *call);
  }
}

asio::awaitable<absl::StatusOr<ForwardedRequest>> RpcGateway::ReadRequest(HttpExchange& exchange,
                                                                          const MethodDescriptor& method,
                                                                          const RpcFormat& format) {
  const HttpRequest& request = exchange.request();
  ForwardedRequest forwarded;
  forwarded.path = request.path;
  auto metadata = MetadataIn(request);
  if (!metadata.ok()) co_return metadata.status();
  forwarded.metadata = *std::move(metadata);
  // Before the body is read.
  const std::string_view token = request.Header("authorization");
  const absl::Status may_call =
      access_.MayCall(request.path, request.headers.count("authorization") > 0 ? std::optional(token) : std::nullopt,
                      request.certificate_names);
  if (!may_call.ok()) co_return may_call;
  if (method.client_streaming() && format.protocol != RpcProtocol::kConnectStream) {
    co_return absl::UnimplementedError(
        fmt::format("{} is a client stream, which this protocol does not have", method.full_name()));
  }
  const ForwardedCaller caller{request.peer, request.certificate_names};
  forwarded.metadata.emplace_back(kForwardedCaller, access_.forwarding_key().Encode(caller));
  const auto timeout = TimeoutOf(request, format);
  if (!timeout.ok()) co_return timeout.status();
  if (*timeout) {
    forwarded.deadline =
        std::chrono::system_clock::now() + std::chrono::duration_cast<std::chrono::system_clock::duration>(**timeout);
  }
  const std::string_view encoding = request.Header("content-encoding");
  if (!encoding.empty() && encoding != "identity") {
    co_return absl::UnimplementedError("compressed requests are not accepted");
  }
  // Base64 and the prefix of a message add to its size.
  const std::size_t max_bytes = (format.base64 ? max_message_bytes_ / 3 * 4 : max_message_bytes_) + 64;
  absl::StatusOr<std::string> body = co_await exchange.ReadBody(max_bytes);
  if (!body.ok()) co_return body.status();
  auto messages = SplitBody(format, *std::move(body));
  if (!messages.ok()) co_return messages.status();
  if (!method.client_streaming() && messages->size() != 1) {
    co_return absl::InvalidArgumentError(
        fmt::format("{} takes one message; the body has {}", method.full_name(), messages->size()));
  }
  forwarded.messages = *std::move(messages);
  if (!format.json) co_return forwarded;
  std::stop_source stop;
  std::function<void()> request_stop = [stop]() mutable { stop.request_stop(); };
  exchange.OnDisconnect(std::move(request_stop));
  for (std::string& message : forwarded.messages) {
    TranscoderPool::Work transcode = [this, &method, &message](const std::function<bool()>& is_wanted) {
      return JsonToMessage(*method.input_type(), message, {.max_bytes = max_message_bytes_, .is_wanted = is_wanted});
    };
    const std::size_t bytes = message.size();
    std::stop_token disconnected = stop.get_token();
    absl::StatusOr<std::string> binary =
        co_await Transcode(exchange, bytes, std::move(disconnected), std::move(transcode));
    if (!binary.ok()) co_return binary.status();
    message = *std::move(binary);
  }
  co_return forwarded;
}

asio::awaitable<absl::StatusOr<std::string>> RpcGateway::Transcode(HttpExchange& exchange, std::size_t bytes,
                                                                   std::stop_token disconnected,
                                                                   TranscoderPool::Work work) {
  if (bytes < kLargeBytes) co_return work([] { return true; });
  asio::any_io_executor executor = exchange.executor();
  absl::StatusOr<std::string> result =
      co_await transcoders_.Run(bytes, std::move(disconnected), std::move(executor), std::move(work));
  co_return result;
}

asio::awaitable<absl::StatusOr<std::string>> RpcGateway::Encode(HttpExchange& exchange, const MethodDescriptor& method,
                                                                const RpcFormat& format, std::string message) {
  if (!format.json) co_return FrameMessage(format, std::move(message));
  TranscoderPool::Work transcode = [&](const std::function<bool()>& /*is_wanted*/) {
    absl::StatusOr<std::string> json = MessageToJson(*method.output_type(), message);
    if (json.ok()) json = FrameMessage(format, *std::move(json));
    return json;
  };
  const std::size_t bytes = message.size();
  std::stop_token none;
  absl::StatusOr<std::string> result = co_await Transcode(exchange, bytes, std::move(none), std::move(transcode));
  co_return result;
}

asio::awaitable<void> RpcGateway::AnswerUnary(HttpExchange& exchange, const MethodDescriptor& method,
                                              const RpcFormat& format, ForwardedCall& call) {
  std::optional<std::string> message = co_await call.Read();
  if (message) {
    const std::optional<std::string> none = co_await call.Read();
    static_cast<void>(none);
  }
  grpc::Status status = co_await EndOf(call, method);
  if (!status.ok() || !message) {
    co_await ReplyError(exchange, format, std::move(status));
    co_return;
  }
  absl::StatusOr<std::string> body = co_await Encode(exchange, method, format, *std::move(message));
  if (!body.ok()) {
    status = ToGrpc(body.status());
    co_await ReplyError(exchange, format, std::move(status));
    co_return;
  }
  HttpResponse response{.status = 200, .headers = UnaryTrailers(call.Trailers()), .body = *std::move(body)};
  response.headers.emplace_back("content-type", format.content_type);
  response.headers.emplace_back("cache-control", "no-store");
  co_await exchange.Reply(std::move(response));
}

asio::awaitable<void> RpcGateway::AnswerStream(HttpExchange& exchange, const MethodDescriptor& method,
                                               const RpcFormat& format, ForwardedCall& call) {
  std::optional<std::string> message = co_await call.Read();
  if (!message) {
    grpc::Status status = co_await EndOf(call, method);
    if (status.ok() && format.protocol == RpcProtocol::kJsonLines) {
      HttpResponse empty{.status = 200, .headers = {{"content-type", format.content_type}}, .body = ""};
      co_await exchange.Reply(std::move(empty));
    } else {
      co_await ReplyError(exchange, format, std::move(status));
    }
    co_return;
  }
  HttpHeaders headers = {{"content-type", format.content_type},
                         {"cache-control", "no-store"},
                         {"x-accel-buffering", "no"}};  // a proxy in between passes events on at once
  co_await exchange.Begin(200, std::move(headers));
  std::optional<grpc::Status> failure;
  while (message && !failure) {
    absl::StatusOr<std::string> framed = co_await Encode(exchange, method, format, *std::move(message));
    if (!framed.ok()) {
      failure = ToGrpc(framed.status());
      break;
    }
    const bool sent = co_await exchange.Write(*std::move(framed));
    if (!sent) break;
    message = co_await call.Read();
  }
  if (message || failure) call.Cancel();
  grpc::Status status = co_await call.Finish();
  if (failure) status = *failure;
  std::string end = FrameEnd(format, status, call.Trailers());
  co_await exchange.Write(std::move(end));
  co_await exchange.End();
}

}  // namespace dlcs
