// SPDX-License-Identifier: Apache-2.0
#include "client/client.h"

#include <fmt/format.h>
#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <utility>

#include "client/ensemble_result.h"
#include "client/rpc_error.h"

namespace dlcs::client {
namespace {

// What every call carries: a deadline, and a way to be cancelled while it runs.
class Call {
 public:
  explicit Call(const CallLimits& limits) : cancel_(limits.stop, [this] { context_.TryCancel(); }) {
    const auto now = std::chrono::system_clock::now();
    // Decades are as good as for ever, and do not overflow the clock.
    constexpr std::chrono::duration<double> kLongest = std::chrono::hours(24 * 365 * 20);
    const auto allowed = std::min(std::max(limits.deadline, std::chrono::duration<double>::zero()), kLongest);
    context_.set_deadline(now + std::chrono::duration_cast<std::chrono::system_clock::duration>(allowed));
  }

  grpc::ClientContext* context() { return &context_; }

 private:
  grpc::ClientContext context_;
  std::stop_callback<std::function<void()>> cancel_;
};

grpc::ChannelArguments ChannelSettings() {
  grpc::ChannelArguments settings;
  // Small receive windows without growing ones keep a watcher within tens of milliseconds of the engine;
  // the defaults let seconds of iterates pile up in transit.
  settings.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  settings.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 256 << 10);
  // A cut link is noticed after half a minute instead of many; dlcsd permits a ping every 10 s.
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  settings.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
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

absl::StatusOr<std::unique_ptr<Client>> Client::Connect(const std::string& address) {
  if (!IsHostAndPort(address)) {
    return absl::InvalidArgumentError(
        fmt::format("\"{}\" is not HOST:PORT; write for example localhost:50051, or [::1]:50051 for IPv6", address));
  }
  const auto channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), ChannelSettings());
  return std::unique_ptr<Client>(new Client(address, v1::SolverService::NewStub(channel)));
}

Client::Client(std::string address, std::unique_ptr<v1::SolverService::Stub> stub)
    : address_(std::move(address)), stub_(std::move(stub)) {}

absl::StatusOr<SolveResult> Client::Solve(const v1::SolveRequest& request, const EventCallback& on_event,
                                          const CallLimits& limits) {
  const auto start = std::chrono::steady_clock::now();
  ResultCollector collector(request, limits.keep_trajectory);
  Call call(limits);
  const auto reader = stub_->Solve(call.context(), request);
  for (v1::SolveEvent event; reader->Read(&event);) {
    collector.Add(event);
    if (on_event) on_event(event);
  }
  const grpc::Status status = reader->Finish();
  // A summary is the last word, also where the deadline passes between it and the status.
  if (status.ok() || collector.has_summary()) return std::move(collector).Finish();

  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (status.error_code() == grpc::StatusCode::CANCELLED && limits.stop.stop_requested()) {
    return std::move(collector).Abandon(v1::CANCELLED, seconds.count());
  }
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED && collector.accepted()) {
    return std::move(collector).Abandon(v1::DEADLINE, seconds.count());
  }
  return DescribeRpcError(status, address_);
}

absl::StatusOr<v1::EnsembleSummary> Client::SolveEnsemble(const v1::SolveEnsembleRequest& request,
                                                          const MemberCallback& on_member, const CallLimits& limits) {
  const auto start = std::chrono::steady_clock::now();
  EnsembleCollector collector(request, on_member, limits.keep_trajectory);
  Call call(limits);
  const auto reader = stub_->SolveEnsemble(call.context(), request);
  for (v1::EnsembleEvent event; reader->Read(&event);) collector.Add(std::move(event));
  const grpc::Status status = reader->Finish();
  if (status.ok() || collector.has_summary()) return std::move(collector).Finish();

  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (status.error_code() == grpc::StatusCode::CANCELLED && limits.stop.stop_requested()) {
    return std::move(collector).Abandon("Cancelled.", seconds.count());
  }
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED && collector.accepted()) {
    return std::move(collector).Abandon("The deadline passed. Allow more time or ask for fewer members.",
                                        seconds.count());
  }
  return DescribeRpcError(status, address_);
}

// A call with one answer, a method of the stub.
template <typename Request, typename Response>
absl::StatusOr<Response> Client::Ask(UnaryMethod<Request, Response> method, const Request& request,
                                     const CallLimits& limits) {
  Call call(limits);
  Response response;
  const grpc::Status status = ((*stub_).*method)(call.context(), request, &response);
  if (!status.ok()) return DescribeRpcError(status, address_);
  return response;
}

absl::StatusOr<v1::SolveLcpResponse> Client::SolveLcp(const v1::SolveLcpRequest& request, const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::SolveLcp, request, limits);
}

absl::StatusOr<v1::SolveDcpResponse> Client::SolveDcp(const v1::SolveDcpRequest& request, const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::SolveDcp, request, limits);
}

absl::StatusOr<v1::AnalyzeProblemResponse> Client::AnalyzeProblem(const v1::AnalyzeProblemRequest& request,
                                                                  const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::AnalyzeProblem, request, limits);
}

absl::StatusOr<v1::GetCapabilitiesResponse> Client::GetCapabilities(const CallLimits& limits) {
  return Ask(&v1::SolverService::Stub::GetCapabilities, v1::GetCapabilitiesRequest(), limits);
}

}  // namespace dlcs::client
