// SPDX-License-Identifier: Apache-2.0
#include "server/wire/status.h"

#include <string>
#include <vector>

#include "absl/strings/cord.h"
#include "core/problem/violation_list.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "proto/shared/truncate_text.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

// The two enumerations share their numbers; naming each one lets the compiler notice a new one.
grpc::StatusCode ToGrpcCode(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:
      return grpc::StatusCode::OK;
    case absl::StatusCode::kCancelled:
      return grpc::StatusCode::CANCELLED;
    case absl::StatusCode::kUnknown:
      return grpc::StatusCode::UNKNOWN;
    case absl::StatusCode::kInvalidArgument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case absl::StatusCode::kDeadlineExceeded:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    case absl::StatusCode::kNotFound:
      return grpc::StatusCode::NOT_FOUND;
    case absl::StatusCode::kAlreadyExists:
      return grpc::StatusCode::ALREADY_EXISTS;
    case absl::StatusCode::kPermissionDenied:
      return grpc::StatusCode::PERMISSION_DENIED;
    case absl::StatusCode::kResourceExhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case absl::StatusCode::kFailedPrecondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case absl::StatusCode::kAborted:
      return grpc::StatusCode::ABORTED;
    case absl::StatusCode::kOutOfRange:
      return grpc::StatusCode::OUT_OF_RANGE;
    case absl::StatusCode::kUnimplemented:
      return grpc::StatusCode::UNIMPLEMENTED;
    case absl::StatusCode::kInternal:
      return grpc::StatusCode::INTERNAL;
    case absl::StatusCode::kUnavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case absl::StatusCode::kDataLoss:
      return grpc::StatusCode::DATA_LOSS;
    case absl::StatusCode::kUnauthenticated:
      return grpc::StatusCode::UNAUTHENTICATED;
    case absl::StatusCode::kDoNotUseReservedForFutureExpansionUseDefaultInSwitchInstead_:
      break;
  }
  return grpc::StatusCode::UNKNOWN;
}

// The violations that fit, long texts cut.
google::rpc::BadRequest BadRequestOf(const std::vector<Violation>& violations) {
  constexpr std::size_t kMaxFieldBytes = 128;
  constexpr std::size_t kMaxDescriptionBytes = 384;
  google::rpc::BadRequest bad_request;
  std::size_t bytes = 0;
  for (const Violation& violation : violations) {
    const std::string field = TruncateUtf8(violation.field, kMaxFieldBytes);
    const std::string description = TruncateUtf8(violation.description, kMaxDescriptionBytes);
    bytes += field.size() + description.size() + 8;  // 8: tags and lengths
    if (bad_request.field_violations_size() == kMaxReportedViolations || bytes > kMaxViolationBytes) break;
    auto& reported = *bad_request.add_field_violations();
    reported.set_field(field);
    reported.set_description(description);
  }
  return bad_request;
}

std::vector<Violation> ViolationsOf(const google::rpc::BadRequest& bad_request) {
  std::vector<Violation> violations;
  for (const auto& reported : bad_request.field_violations()) {
    violations.push_back({reported.field(), reported.description()});
  }
  return violations;
}

}  // namespace

grpc::Status ToGrpc(const absl::Status& plain) {
  if (plain.ok()) return grpc::Status::OK;
  const absl::Status status = ForCallers(plain);
  google::rpc::Status rich;
  rich.set_code(status.raw_code());
  rich.set_message(TruncateUtf8(std::string(status.message()), kMaxMessageBytes));
  const std::vector<Violation> violations = ViolationsOf(status);
  if (!violations.empty()) rich.add_details()->PackFrom(BadRequestOf(violations));
  status.ForEachPayload([&rich](absl::string_view type_url, const absl::Cord& payload) {
    if (type_url == kViolationsPayload) return;
    auto& detail = *rich.add_details();
    detail.set_type_url(std::string(type_url));
    detail.set_value(std::string(payload));
  });
  return grpc::Status(ToGrpcCode(status.code()), rich.message(),
                      rich.details().empty() ? std::string() : rich.SerializeAsString());
}

absl::Status FromGrpc(const grpc::Status& status) {
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  google::rpc::Status rich;
  if (!status.ok() && rich.ParseFromString(status.error_details())) {
    for (const auto& detail : rich.details()) {
      google::rpc::BadRequest bad_request;
      if (detail.UnpackTo(&bad_request)) {
        AttachViolations(ViolationsOf(bad_request), result);
      } else {
        result.SetPayload(detail.type_url(), absl::Cord(detail.value()));
      }
    }
  }
  return result;
}

}  // namespace dlcs
