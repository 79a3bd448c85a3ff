// SPDX-License-Identifier: Apache-2.0
// The trace id of all calls of this program, which can be found in the logs of servers.

#ifndef DLCS_CLIENT_RPC_TRACE_H_
#define DLCS_CLIENT_RPC_TRACE_H_

#include <string>

namespace dlcs::client {

// The trace id in the environment variable TRACEPARENT (W3C Trace Context) if that is valid, otherwise a random one.
// Safe from any thread.
const std::string& ThisTraceId();

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_TRACE_H_
