// SPDX-License-Identifier: Apache-2.0
#include "server/wire/errors.h"

#include "absl/strings/cord.h"
#include "absl/strings/escaping.h"
#include "fmt/format.h"
#include "google/rpc/error_details.pb.h"
#include "proto/shared/truncate_text.h"

namespace dlcs {
namespace {

constexpr char kTypeUrlPrefix[] = "type.googleapis.com/";
// Nobody has registered a name for the project; names under .internal are for private use.
constexpr char kErrorDomain[] = "dlcs.v1";

template <typename Detail>
std::string TypeUrl() {
  return kTypeUrlPrefix + Detail::descriptor()->full_name();
}

template <typename Detail>
void Attach(const Detail& detail, absl::Status& status) {
  status.SetPayload(TypeUrl<Detail>(), absl::Cord(detail.SerializeAsString()));
}

google::rpc::ErrorInfo MakeErrorInfo(const std::string& reason) {
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  info.set_domain(kErrorDomain);
  return info;
}

// The reason for errors without an ErrorInfo, by code; the message has the details.
const char* ReasonOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kInvalidArgument:
      return "INVALID_REQUEST";
    case absl::StatusCode::kNotFound:
      return "NO_SUCH_RESOURCE";
    case absl::StatusCode::kAlreadyExists:
      return "REQUEST_ID_REUSED";
    case absl::StatusCode::kFailedPrecondition:
      return "STATE_FORBIDS";
    case absl::StatusCode::kOutOfRange:
      return "NO_SUCH_EVENT";
    case absl::StatusCode::kResourceExhausted:
      return "LIMIT_EXCEEDED";
    case absl::StatusCode::kUnavailable:
      return "STORE_UNAVAILABLE";
    case absl::StatusCode::kDataLoss:
      return "STORE_DAMAGED";
    case absl::StatusCode::kUnauthenticated:
      return "UNKNOWN_CALLER";
    case absl::StatusCode::kPermissionDenied:
      return "MISSING_RIGHT";
    case absl::StatusCode::kUnimplemented:
      return "NOT_OFFERED";
    case absl::StatusCode::kCancelled:
      return "CANCELLED";
    case absl::StatusCode::kDeadlineExceeded:
      return "DEADLINE_EXCEEDED";
    default:
      return "INTERNAL_ERROR";
  }
}

}  // namespace

std::string Quoted(std::string_view text) {
  constexpr std::size_t kMaxBytes = 96;
  const std::string shortened = TruncateUtf8(std::string(text.substr(0, kMaxBytes + 4)), kMaxBytes);
  return fmt::format("\"{}\"", std::string(absl::Utf8SafeCHexEscape(shortened)));
}

absl::Status InvalidRequest(const std::vector<Violation>& violations) {
  std::string message;
  if (!violations.empty()) {
    message = TruncateUtf8(violations[0].field + ": " + violations[0].description, kMaxMessageBytes - 64);
  }
  if (violations.size() > 1) {
    message += fmt::format(" (the first of {} violations)", violations.size());
  }
  absl::Status status = absl::InvalidArgumentError(message);
  AttachViolations(violations, status);
  return status;
}

absl::Status Refused(const std::string& message, const LimitCase& limit,
                     std::optional<std::chrono::milliseconds> retry_after) {
  std::string text = message;
  if (retry_after) text += fmt::format(" Try again in {:.1f} s.", std::chrono::duration<double>(*retry_after).count());
  absl::Status status = absl::ResourceExhaustedError(text);
  google::rpc::ErrorInfo info = MakeErrorInfo(retry_after ? "SERVER_BUSY" : "LIMIT_EXCEEDED");
  (*info.mutable_metadata())["limit"] = limit.limit;
  (*info.mutable_metadata())["value"] = fmt::format("{:.15g}", limit.value);
  (*info.mutable_metadata())["requested"] = fmt::format("{:.15g}", limit.requested);
  Attach(info, status);
  if (retry_after) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(retry_after->count() / 1000);
    retry.mutable_retry_delay()->set_nanos(static_cast<int>(retry_after->count() % 1000) * 1'000'000);
    Attach(retry, status);
  }
  return status;
}

absl::Status LimitExceeded(const std::string& limit, std::int64_t value, std::int64_t requested) {
  return Refused(
      fmt::format("The request needs {} = {}, and this server allows {}. Ask for less, or run a server with a "
                  "higher limit.",
                  limit, requested, value),
      {limit, static_cast<double>(value), static_cast<double>(requested)}, std::nullopt);
}

absl::Status ServerBusy(const std::string& limit, std::int64_t value, std::chrono::milliseconds retry_after) {
  return Refused(fmt::format("The server is busy: {} = {} is reached.", limit, value),
                 {limit, static_cast<double>(value), static_cast<double>(value) + 1}, retry_after);
}

absl::Status ShuttingDown() {
  absl::Status status = absl::UnavailableError("The server is shutting down. Try another one, or later.");
  Attach(MakeErrorInfo("SHUTTING_DOWN"), status);
  return status;
}

absl::Status ForCallers(absl::Status status) {
  if (!status.ok() && !status.GetPayload(TypeUrl<google::rpc::ErrorInfo>())) {
    Attach(MakeErrorInfo(ReasonOf(status.code())), status);
  }
  return status;
}

}  // namespace dlcs
