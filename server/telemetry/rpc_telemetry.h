// SPDX-License-Identifier: Apache-2.0
// Counts, times and logs every call of every service by an interceptor, without code in the services.

#ifndef DLCS_SERVER_TELEMETRY_RPC_TELEMETRY_H_
#define DLCS_SERVER_TELEMETRY_RPC_TELEMETRY_H_

#include <memory>

#include "grpcpp/support/server_interceptor.h"
#include "server/access/access.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

// For ServerBuilder: counts calls, and the events, gaps and lag of streams of events, as they pass. When a call has
// ended, the log has a line of level debug with its method, code, seconds, user, trace id, and the solve or job that it
// was about. `access` identifies the user; it and `metrics` must outlive the server. Costs some microseconds per call.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> NewRpcTelemetry(Metrics& metrics,
                                                                                       const Access& access);

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_RPC_TELEMETRY_H_
