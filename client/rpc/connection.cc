// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/connection.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <utility>

#include "client/rpc/rpc_error.h"
#include "client/rpc/tls.h"
#include "client/rpc/trace.h"
#include "proto/wire/trace_context.h"

namespace dlcs::client {
namespace {

grpc::ChannelArguments ChannelSettings() {
  grpc::ChannelArguments settings;
  // Small receive windows without growing ones keep a watcher within tens of milliseconds of the engine; with the
  // defaults, seconds of iterates would be in transit.
  settings.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  settings.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 256 << 10);
  // A broken link is noticed after half a minute instead of many; dlcsd permits a ping every 10 s.
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  // After a lost connection the next attempt to connect follows at once, and then at most every two seconds.
  settings.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  settings.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  settings.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  return settings;
}

bool IsUnixSocket(const std::string& address) { return address.starts_with("unix:/"); }

// gRPC would take "localhost" for port 443 and "x:y" for a name to look up.
bool IsHostAndPort(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  const std::string host = address.substr(0, colon);
  const std::string port = address.substr(colon + 1);
  const bool bare_ipv6 = host.find(':') != std::string::npos && host.front() != '[';
  if (bare_ipv6 || port.empty() || port.size() > 5) return false;
  for (const char c : port) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0) return false;
  }
  const int number = std::stoi(port);
  return number > 0 && number < 65536;
}

// Without a name lookup: a name may resolve to another machine a moment later.
bool IsThisMachine(const std::string& address) {
  if (IsUnixSocket(address)) return true;
  const std::string host = address.substr(0, address.rfind(':'));
  in_addr ipv4{};
  if (inet_pton(AF_INET, host.c_str(), &ipv4) == 1) return ntohl(ipv4.s_addr) >> 24 == 127;
  return host == "localhost" || host == "[::1]";
}

// Errors: InvalidArgument for a token that is not allowed in a header, or that would be sent without encryption.
absl::Status CheckToken(const ConnectionOptions& options) {
  constexpr std::size_t kMaxBytes = 1024;
  const auto is_letter = [](unsigned char c) { return c > ' ' && c < 0x7f; };
  const std::string& token = options.token;
  if (token.size() > kMaxBytes || !std::all_of(token.begin(), token.end(), is_letter)) {
    return absl::InvalidArgumentError("token: must be one word of at most 1024 ASCII letters");
  }
  if (token.empty() || options.UsesTls() || IsThisMachine(options.address)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      fmt::format("token: is not sent to {} without encryption; connect with --tls-ca or --tls, or without a token",
                  options.address));
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(const ConnectionOptions& options) {
  if (!options.UsesTls()) return grpc::InsecureChannelCredentials();
  absl::StatusOr<TlsTexts> texts = ReadTls(options);
  if (!texts.ok()) return texts.status();
  return grpc::SslCredentials(
      {.pem_root_certs = texts->ca, .pem_private_key = texts->key, .pem_cert_chain = texts->certificate});
}

}  // namespace

absl::Status CheckAddress(const std::string& address) {
  if (IsUnixSocket(address) || IsHostAndPort(address)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      fmt::format("address: \"{}\" is not HOST:PORT, with a port up to 65535; write for example localhost:50051, "
                  "[::1]:50051 for IPv6, or unix:/PATH",
                  address));
}

absl::StatusOr<Connection> Connection::Open(const ConnectionOptions& options) {
  if (absl::Status address = CheckAddress(options.address); !address.ok()) return address;
  if (absl::Status token = CheckToken(options); !token.ok()) return token;
  const auto credentials = CredentialsOf(options);
  if (!credentials.ok()) return credentials.status();
  return Connection(options, grpc::CreateCustomChannel(options.address, *credentials, ChannelSettings()));
}

Connection::Connection(ConnectionOptions options, std::shared_ptr<grpc::Channel> channel)
    : options_(std::move(options)), channel_(std::move(channel)) {}

// Without details it comes from a proxy, the network or TLS, not from a dlcsd.
bool Connection::IsAnswer(const grpc::Status& status) {
  return status.error_code() != grpc::StatusCode::UNAVAILABLE || !status.error_details().empty();
}

std::optional<absl::Status> Connection::PermanentFailure(const grpc::Status& status) const {
  if (IsAnswer(status)) return std::nullopt;
  const std::optional<std::string> wrong = DiagnoseTls(options_);
  if (!wrong) return std::nullopt;
  return absl::UnavailableError(fmt::format("no connection to the server at {}: {}", options_.address, *wrong));
}

absl::Status Connection::Describe(const grpc::Status& status) const {
  if (const std::optional<absl::Status> never = PermanentFailure(status)) return *never;
  if (has_answered() && !IsAnswer(status) && !status.error_message().starts_with("failed to connect")) {
    return absl::UnavailableError(fmt::format(
        "the connection to the server at {} was lost ({}); the server may have ended. Run it again, or as a "
        "job (dlcs submit), which a server with --store resumes",
        options_.address, status.error_message()));
  }
  return DescribeRpcError(status, options_.address);
}

Call::Call(const Connection& connection, const CallLimits& limits)
    : cancel_(limits.stop, [this] { context_.TryCancel(); }) {
  context_.AddMetadata(kTraceparent, TraceparentOf(ThisTraceId()));
  const std::string& token = connection.options().token;
  if (!token.empty()) context_.AddMetadata("authorization", "Bearer " + token);
  const auto now = std::chrono::system_clock::now();
  // Decades instead of infinity, which would overflow the clock.
  constexpr std::chrono::duration<double> kLongest = std::chrono::hours(24 * 365 * 20);
  const auto allowed = std::min(std::max(limits.deadline, std::chrono::duration<double>::zero()), kLongest);
  context_.set_deadline(now + std::chrono::duration_cast<std::chrono::system_clock::duration>(allowed));
}

}  // namespace dlcs::client
