// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/health.h"

#include "client/rpc/connection.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace dlcs::client {
namespace {

namespace wire = grpc::health::v1;

Health HealthOf(wire::HealthCheckResponse::ServingStatus status) {
  switch (status) {
    case wire::HealthCheckResponse::SERVING:
      return Health::kServing;
    case wire::HealthCheckResponse::NOT_SERVING:
      return Health::kNotServing;
    case wire::HealthCheckResponse::SERVICE_UNKNOWN:
      return Health::kServiceUnknown;
    default:  // and what later versions of the contract may add
      return Health::kUnknown;
  }
}

}  // namespace

const char* HealthName(Health health) {
  switch (health) {
    case Health::kServing:
      return "SERVING";
    case Health::kNotServing:
      return "NOT_SERVING";
    case Health::kServiceUnknown:
      return "SERVICE_UNKNOWN";
    case Health::kUnknown:
      break;
  }
  return "UNKNOWN";
}

absl::StatusOr<Health> CheckHealth(const ConnectionOptions& server, const std::string& service,
                                   const CallLimits& limits) {
  const absl::StatusOr<Connection> connection = Connection::Open(server);
  if (!connection.ok()) return connection.status();
  const auto stub = wire::Health::NewStub(connection->channel());
  Call call(*connection, limits);
  wire::HealthCheckRequest request;
  wire::HealthCheckResponse response;
  request.set_service(service);
  const grpc::Status status = stub->Check(call.context(), request, &response);
  // Watch() has a state for it, Check() this code.
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) return Health::kServiceUnknown;
  if (!status.ok()) return connection->Describe(status);
  return HealthOf(response.status());
}

}  // namespace dlcs::client
