// SPDX-License-Identifier: Apache-2.0
// absl::Status <-> grpc::Status, details included.

#ifndef DLCS_SERVER_WIRE_STATUS_H_
#define DLCS_SERVER_WIRE_STATUS_H_

#include <cstddef>

#include "absl/status/status.h"
#include "grpcpp/support/status.h"

namespace dlcs {

// Errors travel in HTTP/2 headers, of which gRPC accepts 8 KB by default: beyond about 6 KB after base64 the whole
// error is lost. Hence at most this many violations and bytes of them, and a short message.
inline constexpr int kMaxReportedViolations = 32;
inline constexpr std::size_t kMaxViolationBytes = 4096;

// The same code and message (shortened to what headers can carry). The violations that `status` carries become a
// google.rpc.BadRequest, and its other payloads the details that they are, of a google.rpc.Status in the trailer.
grpc::Status ToGrpc(const absl::Status& status);

// The inverse: a BadRequest becomes violations, other details become payloads, keyed by their type URL.
absl::Status FromGrpc(const grpc::Status& status);

}  // namespace dlcs

#endif  // DLCS_SERVER_WIRE_STATUS_H_
