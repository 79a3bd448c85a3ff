// SPDX-License-Identifier: Apache-2.0
// The health of a server, from the standard gRPC health service.

#ifndef DLCS_CLIENT_RPC_HEALTH_H_
#define DLCS_CLIENT_RPC_HEALTH_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/result/backend.h"
#include "client/rpc/connection_options.h"

namespace dlcs::client {

enum class Health {
  kUnknown,         // the server does not know
  kServing,         // it serves calls
  kNotServing,      // it is shutting down, or its job store does not answer
  kServiceUnknown,  // it has no service of that name
};

// "SERVING", "NOT_SERVING", ..., as in the health service.
const char* HealthName(Health health);

// The health of `service`, "dlcs.v1.JobService" for one; of the server as a whole where that is empty. One call of
// grpc.health.v1.Health/Check, which is not repeated and needs no token. Errors: as Client::Connect(), and those of the
// call. May be called from several threads at once.
absl::StatusOr<Health> CheckHealth(const ConnectionOptions& server, const std::string& service,
                                   const CallLimits& limits);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_HEALTH_H_
