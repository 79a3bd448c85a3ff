// SPDX-License-Identifier: Apache-2.0
// absl::Status <-> grpc::Status, details included.

#ifndef DLCS_SERVER_WIRE_STATUS_H_
#define DLCS_SERVER_WIRE_STATUS_H_

#include "absl/status/status.h"
#include "grpcpp/support/status.h"

namespace dlcs {

// The same code and message (shortened to what headers can carry); the payloads of `status` become the
// details of a google.rpc.Status in the trailer.
grpc::Status ToGrpc(const absl::Status& status);

// The way back: details become payloads, keyed by their type URL.
absl::Status FromGrpc(const grpc::Status& status);

}  // namespace dlcs

#endif  // DLCS_SERVER_WIRE_STATUS_H_
