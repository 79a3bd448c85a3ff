// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/rpc_error.h"

#include <fmt/format.h>

#include <optional>

#include "absl/strings/cord.h"
#include "client/rpc/trace.h"
#include "google/rpc/status.pb.h"

namespace dlcs::client {
namespace {

constexpr char kBadRequestUrl[] = "type.googleapis.com/google.rpc.BadRequest";

struct Details {
  std::optional<google::rpc::BadRequest> bad_request;
  std::optional<google::rpc::ErrorInfo> error_info;
  std::optional<google::rpc::RetryInfo> retry_info;
};

template <typename Message>
void Unpack(const google::protobuf::Any& any, std::optional<Message>& message) {
  Message unpacked;
  if (any.Is<Message>() && any.UnpackTo(&unpacked)) message = unpacked;
}

Details DetailsOf(const grpc::Status& status) {
  Details details;
  google::rpc::Status rich;
  if (!rich.ParseFromString(status.error_details())) return details;
  for (const google::protobuf::Any& any : rich.details()) {
    Unpack(any, details.bad_request);
    Unpack(any, details.error_info);
    Unpack(any, details.retry_info);
  }
  return details;
}

// Empty if `said` contains it already.
std::string WhenToRetry(const Details& details, const std::string& said) {
  if (!details.retry_info || said.find("Try again in") != std::string::npos) return "";
  const auto& delay = details.retry_info->retry_delay();
  const double seconds = static_cast<double>(delay.seconds()) + 1e-9 * delay.nanos();
  return fmt::format(" Try again in {:.3g} s.", seconds);
}

// No server answers at `address`; `said` is the message of gRPC.
std::string NoAnswer(const std::string& address, const std::string& said) {
  const std::string host = address.substr(0, address.rfind(':'));
  const bool no_name =
      said.find("DNS resolution failed") != std::string::npos || said.find("ares") != std::string::npos;
  if (no_name) {
    return fmt::format("no host \"{}\" was found (DNS has no address for it). Check the spelling of HOST in --server",
                       host);
  }
  if (said.find("http1.x server") != std::string::npos) {
    return fmt::format(
        "the program at {} speaks HTTP/1.1 and not gRPC; is it the port of --http-listen or "
        "--metrics-listen of a dlcsd? Give that of its --listen (50051 by default)",
        address);
  }
  const bool here = host == "localhost" || host == "[::1]" || host.starts_with("127.");
  return fmt::format("no server answers at {} ({}). Check host and port{}", address, ConnectFailureReason(said),
                     here ? ", or start one with: dlcsd --listen " + address : ", and that a dlcsd runs there");
}

std::string Describe(const grpc::Status& status, const Details& details, const std::string& address) {
  const bool ours = details.error_info.has_value();
  const std::string& said = status.error_message();
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      if (ours)
        return fmt::format("the server at {} cannot take the call: {}{}", address, said, WhenToRetry(details, said));
      return NoAnswer(address, said);
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return fmt::format("the server at {} refuses: {}{}", address, said, WhenToRetry(details, said));
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return fmt::format("the deadline passed before {} answered. Allow more time, or check that a dlcsd listens there",
                         address);
    case grpc::StatusCode::UNIMPLEMENTED:
      if (said.ends_with('.')) break;  // a sentence, so it is a message of dlcsd with the reason
      return fmt::format(
          "the program at {} does not offer this call{}. Is it a dlcsd of this version? Jobs and uploads need one "
          "with --store",
          address, said.empty() ? "" : " (" + said + ")");
    case grpc::StatusCode::UNAUTHENTICATED:
      return fmt::format(
          "the server at {} does not accept your identity: {} Give your token with --token-file or DLCS_TOKEN", address,
          said);
    case grpc::StatusCode::PERMISSION_DENIED:
      return fmt::format("the server at {} does not allow it: {} Ask the operator of the server", address, said);
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNKNOWN:
      return fmt::format("the server at {} failed: {}. Its log has the details, with trace_id {}", address, said,
                         ThisTraceId());
    default:
      break;
  }
  return fmt::format("the server at {} refuses: {}", address, said);
}

}  // namespace

std::string ConnectFailureReason(const std::string& said) {
  const std::size_t last = said.rfind(": ");
  return last == std::string::npos ? said : said.substr(last + 2);
}

absl::Status BadRequestError(const google::rpc::BadRequest& bad_request) {
  std::string text;
  for (const auto& violation : bad_request.field_violations()) {
    if (!text.empty()) text += '\n';
    text += violation.field().empty() ? violation.description()
                                      : fmt::format("{}: {}", violation.field(), violation.description());
  }
  absl::Status status = absl::InvalidArgumentError(text);
  status.SetPayload(kBadRequestUrl, absl::Cord(bad_request.SerializeAsString()));
  return status;
}

google::rpc::BadRequest BadRequestOf(const absl::Status& status) {
  google::rpc::BadRequest bad_request;
  if (const auto payload = status.GetPayload(kBadRequestUrl)) bad_request.ParseFromString(std::string(*payload));
  return bad_request;
}

absl::Status DescribeRpcError(const grpc::Status& status, const std::string& address) {
  const Details details = DetailsOf(status);
  if (details.bad_request) return BadRequestError(*details.bad_request);
  // The canonical codes have the same numbers in both libraries.
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), Describe(status, details, address));
}

}  // namespace dlcs::client
