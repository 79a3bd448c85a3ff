// SPDX-License-Identifier: Apache-2.0
// Where a solve runs: behind a server (Client) or in this process (LocalBackend). Both give the same events
// and the same result, bit for bit.

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

// How long a call may take and what ends it early.
struct CallLimits {
  // From the start of the call. There is always one: a call that can hang for ever will, some night.
  std::chrono::duration<double> deadline = std::chrono::minutes(10);
  std::stop_token stop;
  // Whether the result of a solve holds its trajectory. Where it does not, the chunks go to the callback alone: for
  // trajectories that are written down as they come.
  bool keep_trajectory = true;
};

// Called for every event as it arrives, one at a time; a slow callback makes a server conflate iterates.
// Must not throw.
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
// Errors of every call: InvalidArgument with one "field: description" per line when the request breaks a
// rule; otherwise that the call itself failed, with what to do about it.
class Backend {
 public:
  virtual ~Backend() = default;

  // Solves and collects the trajectory. A verdict of the mathematics is a result with that termination; so
  // are a stop (CANCELLED) and a deadline that passed (DEADLINE) once the solve was accepted. Then the
  // trajectory holds what had been computed and, from a server, transferred. `on_event` may be empty.
  virtual absl::StatusOr<SolveResult> Solve(const v1::SolveRequest& request, const EventCallback& on_event,
                                            const CallLimits& limits) = 0;

  // Solves the members of an ensemble, each for `on_member`, which may be empty; holds the result of one at a time. A
  // stop or a deadline that passed is a result too: its summary counts what is known, and in `not_begun` all of which
  // nothing is. Errors besides: DataLoss when the events do not join up.
  virtual absl::StatusOr<v1::EnsembleSummary> SolveEnsemble(const v1::SolveEnsembleRequest& request,
                                                            const MemberCallback& on_member,
                                                            const CallLimits& limits) = 0;

  virtual absl::StatusOr<v1::SolveLcpResponse> SolveLcp(const v1::SolveLcpRequest& request,
                                                        const CallLimits& limits) = 0;

  // A dynamic complementarity problem, or the certificate of a path that the caller has.
  virtual absl::StatusOr<v1::SolveDcpResponse> SolveDcp(const v1::SolveDcpRequest& request,
                                                        const CallLimits& limits) = 0;

  // What is known about a problem before it is solved.
  virtual absl::StatusOr<v1::AnalyzeProblemResponse> AnalyzeProblem(const v1::AnalyzeProblemRequest& request,
                                                                    const CallLimits& limits) = 0;

  virtual absl::StatusOr<v1::GetCapabilitiesResponse> GetCapabilities(const CallLimits& limits) = 0;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RESULT_BACKEND_H_
