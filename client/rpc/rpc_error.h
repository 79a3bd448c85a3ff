// SPDX-License-Identifier: Apache-2.0
// Describes failed calls: what went wrong and what to do.

#ifndef DLCS_CLIENT_RPC_RPC_ERROR_H_
#define DLCS_CLIENT_RPC_RPC_ERROR_H_

#include <grpcpp/support/status.h>

#include <string>

#include "absl/status/status.h"
#include "google/rpc/error_details.pb.h"

namespace dlcs::client {

// The violations of a request, "field: description", one per line.
std::string DescribeViolations(const google::rpc::BadRequest& bad_request);

// `status` (not OK) with the same code. Decodes the details that the service sends (BadRequest, ErrorInfo,
// RetryInfo) into the message; `address` is the server's, for messages.
absl::Status DescribeRpcError(const grpc::Status& status, const std::string& address);

// The reason why no server answers ("Connection refused"), extracted from the message of gRPC.
std::string WhyNobodyAnswers(const std::string& said);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_RPC_ERROR_H_
