// SPDX-License-Identifier: Apache-2.0
// Solves in this process, with the same session code as a server.

#ifndef DLCS_CLIENT_LOCAL_LOCAL_BACKEND_H_
#define DLCS_CLIENT_LOCAL_LOCAL_BACKEND_H_

#include <functional>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/result/backend.h"

namespace dlcs {
struct Problem;
struct SessionLimits;
class SolveControl;
}  // namespace dlcs

namespace dlcs::client {

// Hooks for a solve on many processes (client/mpi).
struct LocalHooks {
  // Whether the request may be solved; may be empty.
  std::function<absl::Status(const v1::SolveRequest&)> check;
  // Changes a valid problem before it is solved; may be empty.
  std::function<void(Problem&)> on_problem;
  // Whether the trajectory of the last solve is elsewhere: the result then has its times alone. May be empty.
  std::function<bool()> has_no_trajectory;
  // Runs an ensemble as RunEnsembleToEnd(); may be empty. Only some processes may receive its members.
  std::function<absl::Status(const v1::SolveEnsembleRequest&, const SessionLimits&, const SolveControl&,
                             const std::function<void(v1::EnsembleEvent)>&)>
      run_ensemble;
  bool receives_members = true;
  // The processes that share a trajectory, each with as much memory as this one.
  int processes = 1;
};

// The only limit is the machine: a trajectory larger than its memory is ResourceExhausted. Events come from the calling
// thread, so a slow callback slows the solve.
class LocalBackend final : public Backend {
 public:
  explicit LocalBackend(LocalHooks hooks = {}) : hooks_(std::move(hooks)) {}

  absl::StatusOr<SolveResult> Solve(const v1::SolveRequest& request, const EventCallback& on_event,
                                    const CallLimits& limits) override;
  absl::StatusOr<v1::EnsembleSummary> SolveEnsemble(const v1::SolveEnsembleRequest& request,
                                                    const MemberCallback& on_member, const CallLimits& limits) override;
  absl::StatusOr<v1::SolveLcpResponse> SolveLcp(const v1::SolveLcpRequest& request, const CallLimits& limits) override;
  absl::StatusOr<v1::SolveDcpResponse> SolveDcp(const v1::SolveDcpRequest& request, const CallLimits& limits) override;
  absl::StatusOr<v1::AnalyzeProblemResponse> AnalyzeProblem(const v1::AnalyzeProblemRequest& request,
                                                            const CallLimits& limits) override;
  absl::StatusOr<v1::GetCapabilitiesResponse> GetCapabilities(const CallLimits& limits) override;

 private:
  const LocalHooks hooks_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_LOCAL_LOCAL_BACKEND_H_
