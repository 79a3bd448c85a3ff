// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/trace.h"

#include <cstdlib>

#include "proto/wire/trace_context.h"

namespace dlcs::client {

const std::string& ThisTraceId() {
  static const std::string id = [] {
    const char* const given = std::getenv("TRACEPARENT");
    const std::string found = given == nullptr ? "" : TraceIdOf(given);
    return found.empty() ? NewTraceId() : found;
  }();
  return id;
}

}  // namespace dlcs::client
