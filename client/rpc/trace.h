// SPDX-License-Identifier: Apache-2.0
// The trace that all calls of this program belong to, so that the logs of servers can be searched for them.

#ifndef DLCS_CLIENT_RPC_TRACE_H_
#define DLCS_CLIENT_RPC_TRACE_H_

#include <string>

namespace dlcs::client {

// Its id: that of the environment variable TRACEPARENT (W3C Trace Context), where there is a sound one, otherwise one
// that was made for this program. Safe from any thread.
const std::string& ThisTraceId();

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_TRACE_H_
