// SPDX-License-Identifier: Apache-2.0
// The trace that a call belongs to.

#ifndef DLCS_SERVER_TELEMETRY_CALL_TRACE_H_
#define DLCS_SERVER_TELEMETRY_CALL_TRACE_H_

#include <string>

#include "grpcpp/server_context.h"
#include "proto/wire/trace_context.h"

namespace dlcs {

// Empty if the call has no valid traceparent.
inline std::string TraceIdOf(const grpc::ServerContextBase& call) {
  const auto found = call.client_metadata().find(kTraceparent);
  return found == call.client_metadata().end() ? "" : TraceIdOf({found->second.data(), found->second.size()});
}

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_CALL_TRACE_H_
