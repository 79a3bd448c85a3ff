// SPDX-License-Identifier: Apache-2.0
// Where a solve runs: on a server (Client) or in this process (LocalBackend). Both give the same events and the same
// result, bit for bit.

#ifndef DLCS_CLIENT_RESULT_BACKEND_H_
#define DLCS_CLIENT_RESULT_BACKEND_H_

#include <chrono>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "client/result/solve_result.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// The time limit of a call, and a way to stop it early.
struct CallLimits {
  // From the start of the call. Every call has one, so that none can hang forever.
  std::chrono::duration<double> deadline = std::chrono::minutes(10);
  std::stop_token stop;
  // Whether the result of a solve holds its trajectory. If not, the chunks are only passed to the callback, for
  // trajectories that are written to a file as they arrive.
  bool keep_trajectory = true;
};

// Called for every event as it arrives, one at a time. If it is slow, a server drops iterates. Must not throw.
using EventCallback = std::function<void(const v1::SolveEvent&)>;

// A member of an ensemble, solved.
struct MemberResult {
  std::int64_t member = 0;  // from 0
  std::string label;
  SolveResult result;  // its analysis is empty
};

// Called for every member that has finished, in any order, one at a time, from any thread. Must not throw.
using MemberCallback = std::function<void(const MemberResult&)>;

// Calls block. An object may be used from several threads at once.
//
// Errors of every call: InvalidArgument with one "field: description" per line if the request breaks a rule; other
// codes if the call itself failed, with advice.
class Backend {
 public:
  virtual ~Backend() = default;

  // Solves and collects the trajectory. If there is no solution, the result has that termination. After the solve was
  // accepted, a stop (CANCELLED) and an expired deadline (DEADLINE) are results too; the trajectory then holds what was
  // computed and, from a server, transferred. `on_event` may be empty.
  virtual absl::StatusOr<SolveResult> Solve(const v1::SolveRequest& request, const EventCallback& on_event,
                                            const CallLimits& limits) = 0;

  // Solves the members of an ensemble, and passes each result to `on_member`, which may be empty; holds one result at a
  // time. After a stop or an expired deadline the summary counts the members whose outcome is known, and in `not_begun`
  // all others. Further errors: DataLoss if events are missing.
  virtual absl::StatusOr<v1::EnsembleSummary> SolveEnsemble(const v1::SolveEnsembleRequest& request,
                                                            const MemberCallback& on_member,
                                                            const CallLimits& limits) = 0;

  virtual absl::StatusOr<v1::SolveLcpResponse> SolveLcp(const v1::SolveLcpRequest& request,
                                                        const CallLimits& limits) = 0;

  // Solves a dynamic complementarity problem, or computes the certificate of a given path.
  virtual absl::StatusOr<v1::SolveDcpResponse> SolveDcp(const v1::SolveDcpRequest& request,
                                                        const CallLimits& limits) = 0;

  // Analyzes a problem without solving it.
  virtual absl::StatusOr<v1::AnalyzeProblemResponse> AnalyzeProblem(const v1::AnalyzeProblemRequest& request,
                                                                    const CallLimits& limits) = 0;

  virtual absl::StatusOr<v1::GetCapabilitiesResponse> GetCapabilities(const CallLimits& limits) = 0;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RESULT_BACKEND_H_
