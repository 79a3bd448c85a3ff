// SPDX-License-Identifier: Apache-2.0
// The trace of which a call says that it is part.

#ifndef DLCS_SERVER_TELEMETRY_CALL_TRACE_H_
#define DLCS_SERVER_TELEMETRY_CALL_TRACE_H_

#include <string>

#include "grpcpp/server_context.h"
#include "proto/wire/trace_context.h"

namespace dlcs {

// Empty where it says nothing, or nothing that makes sense.
inline std::string TraceIdOf(const grpc::ServerContextBase& call) {
  const auto found = call.client_metadata().find(kTraceparent);
  return found == call.client_metadata().end() ? "" : TraceIdOf({found->second.data(), found->second.size()});
}

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_CALL_TRACE_H_
