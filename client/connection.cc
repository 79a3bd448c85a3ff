// SPDX-License-Identifier: Apache-2.0
#include "client/connection.h"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <cctype>
#include <chrono>

#include "client/trace.h"
#include "proto/trace_context.h"

namespace dlcs::client {
namespace {

grpc::ChannelArguments ChannelSettings() {
  grpc::ChannelArguments settings;
  // Small receive windows without growing ones keep a watcher within tens of milliseconds of the engine;
  // the defaults let seconds of iterates pile up in transit.
  settings.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  settings.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 256 << 10);
  // A cut link is noticed after half a minute instead of many; dlcsd permits a ping every 10 s.
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  // After a cut the next attempt to connect follows at once, and then at most every two seconds.
  settings.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  settings.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  settings.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  return settings;
}

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

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const std::string& address) {
  if (IsHostAndPort(address)) {
    return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), ChannelSettings());
  }
  return absl::InvalidArgumentError(
      fmt::format("\"{}\" is not HOST:PORT; write for example localhost:50051, or [::1]:50051 for IPv6", address));
}

Call::Call(const CallLimits& limits) : cancel_(limits.stop, [this] { context_.TryCancel(); }) {
  context_.AddMetadata(kTraceparent, TraceparentOf(ThisTraceId()));
  const auto now = std::chrono::system_clock::now();
  // Decades are as good as for ever, and do not overflow the clock.
  constexpr std::chrono::duration<double> kLongest = std::chrono::hours(24 * 365 * 20);
  const auto allowed = std::min(std::max(limits.deadline, std::chrono::duration<double>::zero()), kLongest);
  context_.set_deadline(now + std::chrono::duration_cast<std::chrono::system_clock::duration>(allowed));
}

}  // namespace dlcs::client
