// SPDX-License-Identifier: Apache-2.0
// The unary calls, from the request on the wire to the response on the wire, without any RPC in them. The server runs
// them on its threads, the command line in its process. All errors carry google.rpc details (server/wire/errors.h).

#ifndef DLCS_SERVER_SESSION_CALL_SESSION_H_
#define DLCS_SERVER_SESSION_CALL_SESSION_H_

#include <stop_token>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"
#include "server/session/problem_reference.h"
#include "server/session/request_check.h"

namespace dlcs {

// One linear complementarity problem. Errors: InvalidArgument with every violation (fields as in SolveLcp()),
// ResourceExhausted naming the limit, Cancelled.
absl::StatusOr<v1::SolveLcpResponse> RunLcp(const v1::SolveLcpRequest& request, const SessionLimits& limits,
                                            std::stop_token stop);

// One dynamic complementarity problem, or the certificate of a path, which is not interrupted. Errors: as RunLcp.
absl::StatusOr<v1::SolveDcpResponse> RunDcp(const v1::SolveDcpRequest& request, const SessionLimits& limits,
                                            std::stop_token stop);

// What is known about a problem before it is solved. If `stop` is triggered, the response holds the finished sections
// and a warning. `find` looks up a problem that is given by name. Errors: as ParseAndValidate() and `find`.
absl::StatusOr<v1::AnalyzeProblemResponse> RunAnalysis(const v1::AnalyzeProblemRequest& request,
                                                       const SessionLimits& limits, std::stop_token stop,
                                                       const ProblemResolver& find = {});

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_CALL_SESSION_H_
