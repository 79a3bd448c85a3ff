// SPDX-License-Identifier: Apache-2.0
// Describes failed calls: what went wrong and what to do.

#ifndef DLCS_CLIENT_RPC_RPC_ERROR_H_
#define DLCS_CLIENT_RPC_RPC_ERROR_H_

#include <grpcpp/support/status.h>

#include <string>

#include "absl/status/status.h"
#include "google/rpc/error_details.pb.h"

namespace dlcs::client {

// InvalidArgument that carries `bad_request` as a payload, keyed by its type URL. The message lists the violations,
// "field: description", one per line.
absl::Status BadRequestError(const google::rpc::BadRequest& bad_request);
// The violations that `status` carries as BadRequestError() has them; empty if it carries none.
google::rpc::BadRequest BadRequestOf(const absl::Status& status);

// `status` (not OK) with the same code. Decodes the details that the service sends (BadRequest, ErrorInfo, RetryInfo)
// into the message; `address` is the server's, for messages. A BadRequest becomes a BadRequestError().
absl::Status DescribeRpcError(const grpc::Status& status, const std::string& address);

// The reason why no server can be reached ("Connection refused"), extracted from the message of gRPC.
std::string ConnectFailureReason(const std::string& said);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_RPC_ERROR_H_
