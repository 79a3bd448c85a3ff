// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/rpc_format.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "fmt/format.h"
#include "google/rpc/status.pb.h"
#include "nlohmann/json.hpp"
#include "server/access/forwarded_caller.h"
#include "server/gateway/json_message.h"

namespace dlcs {
namespace {

using google::protobuf::DescriptorPool;
using Json = nlohmann::json;

constexpr std::size_t kPrefixBytes = 5;  // a byte of flags and four of length, big-endian
// Beyond, a body of prefixes alone would take many times its size in memory.
constexpr std::size_t kMaxMessages = 1 << 17;
constexpr unsigned char kCompressed = 0x01;
constexpr unsigned char kConnectEnd = 0x02;
constexpr unsigned char kGrpcWebTrailers = 0x80;

struct CodeNames {
  const char* connect;
  int http;
};
// By gRPC's code.
constexpr std::array<CodeNames, 17> kCodes = {{{"ok", 200},
                                               {"canceled", 499},
                                               {"unknown", 500},
                                               {"invalid_argument", 400},
                                               {"deadline_exceeded", 504},
                                               {"not_found", 404},
                                               {"already_exists", 409},
                                               {"permission_denied", 403},
                                               {"resource_exhausted", 429},
                                               {"failed_precondition", 400},
                                               {"aborted", 409},
                                               {"out_of_range", 400},
                                               {"unimplemented", 501},
                                               {"internal", 500},
                                               {"unavailable", 503},
                                               {"data_loss", 500},
                                               {"unauthenticated", 401}}};

const CodeNames& NamesOf(const grpc::Status& status) {
  const auto code = static_cast<std::size_t>(status.error_code());
  return kCodes[code < kCodes.size() ? code : static_cast<std::size_t>(grpc::StatusCode::UNKNOWN)];
}

std::string Enveloped(unsigned char flags, std::string_view data) {
  const auto size = static_cast<std::uint32_t>(data.size());
  std::string result;
  result.reserve(kPrefixBytes + data.size());
  result.push_back(static_cast<char>(flags));
  for (const int shift : {24, 16, 8, 0}) result.push_back(static_cast<char>(size >> shift & 0xff));
  result.append(data);
  return result;
}

std::string InBase64(const RpcFormat& format, std::string framed) {
  return format.base64 ? absl::Base64Escape(framed) : framed;
}

// Base64 without padding, as Connect wants it.
std::string Unpadded(const std::string& bytes) {
  std::string text = absl::Base64Escape(bytes);
  while (!text.empty() && text.back() == '=') text.pop_back();
  return text;
}

// The details of an error: each in binary, and in JSON for people.
Json DetailsOf(const grpc::Status& status) {
  google::rpc::Status details;
  Json list = Json::array();
  if (!details.ParseFromString(status.error_details())) return list;
  for (const google::protobuf::Any& detail : details.details()) {
    const std::string name = detail.type_url().substr(detail.type_url().rfind('/') + 1);
    Json one = {{"type", name}, {"value", Unpadded(detail.value())}};
    if (const auto* const type = DescriptorPool::generated_pool()->FindMessageTypeByName(name)) {
      const absl::StatusOr<std::string> text = MessageToJson(*type, detail.value());
      if (text.ok()) one["debug"] = Json::parse(*text, nullptr, false);
    }
    list.push_back(std::move(one));
  }
  return list;
}

Json ErrorJson(const grpc::Status& status) {
  Json error = {{"code", NamesOf(status).connect}};
  if (!status.error_message().empty()) error["message"] = status.error_message();
  Json details = DetailsOf(status);
  if (!details.empty()) error["details"] = std::move(details);
  return error;
}

std::string Dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

bool IsBinary(std::string_view key) { return key.ends_with("-bin"); }

std::string TextOf(const std::string& key, const std::string& value) { return IsBinary(key) ? Unpadded(value) : value; }

// As in the header grpc-message: bytes other than printable ASCII, and '%', as %XX.
std::string PercentEncoded(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte <= 0x7e && c != '%') {
      result += c;
    } else {
      result += fmt::format("%{:02X}", byte);
    }
  }
  return result;
}

// Headers of HTTP, of browsers and of the protocols themselves; all others are metadata.
bool IsOfTransport(std::string_view name) {
  static constexpr std::array kNames = {"accept",
                                        "accept-charset",
                                        "accept-encoding",
                                        "accept-language",
                                        "connection",
                                        "content-encoding",
                                        "content-length",
                                        "content-type",
                                        "cookie",
                                        "cache-control",
                                        "dnt",
                                        "expect",
                                        "forwarded",
                                        "host",
                                        "keep-alive",
                                        "origin",
                                        "pragma",
                                        "priority",
                                        "proxy-connection",
                                        "referer",
                                        "te",
                                        "transfer-encoding",
                                        "upgrade",
                                        "user-agent",
                                        "via",
                                        "x-grpc-web",
                                        "x-user-agent"};
  static constexpr std::array kPrefixes = {":", "access-control-", "connect-", "grpc-", "sec-", "x-forwarded-"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end() ||
         std::any_of(kPrefixes.begin(), kPrefixes.end(),
                     [name](const char* prefix) { return name.starts_with(prefix); });
}

absl::Status BadTimeout(const char* header, std::string_view value, const char* rule) {
  return absl::InvalidArgumentError(fmt::format("{}: {} must be {}", header, ValidUtf8(value.substr(0, 100)), rule));
}

}  // namespace

std::optional<RpcFormat> FormatOf(std::string_view content_type, const google::protobuf::MethodDescriptor& method) {
  std::string type = absl::AsciiStrToLower(std::string(content_type.substr(0, content_type.find(';'))));
  absl::StripAsciiWhitespace(&type);
  const bool unary = !method.client_streaming() && !method.server_streaming();
  if (type == "application/grpc-web" || type == "application/grpc-web+proto") {
    return RpcFormat{RpcProtocol::kGrpcWeb, false, false, "application/grpc-web+proto"};
  }
  if (type == "application/grpc-web-text" || type == "application/grpc-web-text+proto") {
    return RpcFormat{RpcProtocol::kGrpcWeb, false, true, "application/grpc-web-text+proto"};
  }
  if (type == "application/json" && unary) return RpcFormat{RpcProtocol::kConnectUnary, true, false, type};
  if (type == "application/json" && !method.client_streaming()) {
    return RpcFormat{RpcProtocol::kJsonLines, true, false, "application/x-ndjson"};
  }
  if (type == "application/proto" && unary) return RpcFormat{RpcProtocol::kConnectUnary, false, false, type};
  if (type == "application/connect+json" && !unary) return RpcFormat{RpcProtocol::kConnectStream, true, false, type};
  if (type == "application/connect+proto" && !unary) return RpcFormat{RpcProtocol::kConnectStream, false, false, type};
  return std::nullopt;
}

absl::StatusOr<std::vector<std::string>> SplitBody(const RpcFormat& format, std::string body) {
  std::vector<std::string> messages;
  if (format.protocol == RpcProtocol::kConnectUnary || format.protocol == RpcProtocol::kJsonLines) {
    messages.push_back(std::move(body));
    return messages;
  }
  if (format.base64) {
    std::string bytes;
    if (!absl::Base64Unescape(body, &bytes)) return absl::InvalidArgumentError("the body is not base64");
    body = std::move(bytes);
  }
  for (std::string_view rest = body; !rest.empty();) {
    if (rest.size() < kPrefixBytes) return absl::InvalidArgumentError("the body ends inside the prefix of a message");
    const auto flags = static_cast<unsigned char>(rest[0]);
    std::uint32_t size = 0;
    for (std::size_t k = 1; k < kPrefixBytes; ++k) size = size << 8 | static_cast<unsigned char>(rest[k]);
    rest.remove_prefix(kPrefixBytes);
    if (size > rest.size()) {
      return absl::InvalidArgumentError(
          fmt::format("the body ends inside a message: it announces {} bytes and has {}", size, rest.size()));
    }
    if ((flags & kCompressed) != 0) return absl::UnimplementedError("compressed messages are not accepted");
    if ((flags & (kConnectEnd | kGrpcWebTrailers)) == 0) messages.emplace_back(rest.substr(0, size));
    if (messages.size() > kMaxMessages) {
      return absl::InvalidArgumentError(fmt::format("the body has more than {} messages", kMaxMessages));
    }
    rest.remove_prefix(size);
  }
  return messages;
}

std::string FrameMessage(const RpcFormat& format, std::string message) {
  switch (format.protocol) {
    case RpcProtocol::kConnectUnary:
      return message;
    case RpcProtocol::kJsonLines:
      return std::move(message) + "\n";
    default:
      return InBase64(format, Enveloped(0, message));
  }
}

std::string FrameEnd(const RpcFormat& format, const grpc::Status& status, const RpcTrailers& trailers) {
  if (format.protocol == RpcProtocol::kGrpcWeb) {
    std::string text = fmt::format("grpc-status: {}\r\ngrpc-message: {}\r\n", static_cast<int>(status.error_code()),
                                   PercentEncoded(status.error_message()));
    if (!status.error_details().empty()) {
      text += "grpc-status-details-bin: " + absl::Base64Escape(status.error_details()) + "\r\n";
    }
    for (const auto& [key, value] : trailers) text += key + ": " + TextOf(key, value) + "\r\n";
    return InBase64(format, Enveloped(kGrpcWebTrailers, text));
  }
  if (format.protocol == RpcProtocol::kConnectStream) {
    Json end = Json::object();
    if (!status.ok()) end["error"] = ErrorJson(status);
    for (const auto& [key, value] : trailers) end["metadata"][key].push_back(TextOf(key, value));
    return Enveloped(kConnectEnd, Dump(end));
  }
  if (status.ok()) return "";
  return Dump({{"error", ErrorJson(status)}}) + "\n";
}

HttpResponse ErrorResponse(const grpc::Status& status) {
  return {.status = NamesOf(status).http,
          .headers = {{"content-type", "application/json"}},
          .body = Dump(ErrorJson(status))};
}

HttpHeaders UnaryTrailers(const RpcTrailers& trailers) {
  HttpHeaders headers;
  for (const auto& [key, value] : trailers) headers.emplace_back("trailer-" + key, TextOf(key, value));
  return headers;
}

absl::StatusOr<std::optional<std::chrono::nanoseconds>> TimeoutOf(const HttpRequest& request, const RpcFormat& format) {
  const bool grpc_web = format.protocol == RpcProtocol::kGrpcWeb;
  const char* const header = grpc_web ? "grpc-timeout" : "connect-timeout-ms";
  const std::string_view value = request.Header(header);
  if (value.empty()) return std::nullopt;
  const std::size_t most_digits = grpc_web ? 8 : 10;
  const char* const rule = grpc_web ? "1 to 8 digits and H, M, S, m, u or n" : "1 to 10 digits";
  std::int64_t number = 0;
  const auto [rest, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  const auto digits = static_cast<std::size_t>(rest - value.data());
  if (error != std::errc() || number < 0 || digits > most_digits) return BadTimeout(header, value, rule);
  const std::string_view unit = value.substr(digits);
  using namespace std::chrono_literals;
  if (!grpc_web)
    return unit.empty() ? absl::StatusOr<std::optional<std::chrono::nanoseconds>>(number * 1ms)
                        : BadTimeout(header, value, rule);
  static const std::map<std::string_view, std::chrono::nanoseconds> kUnits = {{"H", 1h},  {"M", 1min}, {"S", 1s},
                                                                              {"m", 1ms}, {"u", 1us},  {"n", 1ns}};
  const auto found = kUnits.find(unit);
  if (found == kUnits.end()) return BadTimeout(header, value, rule);
  constexpr std::int64_t kMax = std::int64_t{1} << 62;  // some 146 years
  if (number > kMax / found->second.count()) return std::nullopt;
  return number * found->second;
}

absl::StatusOr<std::vector<std::pair<std::string, std::string>>> MetadataIn(const HttpRequest& request) {
  std::vector<std::pair<std::string, std::string>> metadata;
  for (const auto& header : request.headers) {
    const std::string key =
        absl::AsciiStrToLower(std::string(header.name_string().data(), header.name_string().size()));
    if (IsOfTransport(key)) continue;
    if (key == kForwardedCaller) {
      return absl::PermissionDeniedError(fmt::format("The header {} is reserved for the server itself.", key));
    }
    // gRPC ends the process for a key or a value that it does not accept.
    const auto is_of_key = [](unsigned char c) {
      return std::isdigit(c) != 0 || std::islower(c) != 0 || c == '-' || c == '_' || c == '.';
    };
    if (key.empty() || !std::all_of(key.begin(), key.end(), is_of_key)) continue;
    std::string value(header.value().data(), header.value().size());
    if (IsBinary(key)) {
      std::string bytes;
      if (!absl::Base64Unescape(value, &bytes)) {
        return absl::InvalidArgumentError(fmt::format("the header {} is not base64", key));
      }
      value = std::move(bytes);
    } else if (!std::all_of(value.begin(), value.end(), [](unsigned char c) { return c >= 0x20 && c <= 0x7e; })) {
      return absl::InvalidArgumentError(fmt::format("the header {} must be printable ASCII", key));
    }
    metadata.emplace_back(key, std::move(value));
  }
  return metadata;
}

}  // namespace dlcs
