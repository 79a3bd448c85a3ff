// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/call_environment.h"

#include <string>

#include "absl/status/statusor.h"
#include "server/access/credentials.h"

namespace dlcs {
namespace {

// The waits are short: a read or a commit. The longest is a page of a trajectory.
constexpr int kStoreWorkers = 4;

}  // namespace

CallEnvironment::CallEnvironment(const ServerConfig& server_config, const Access& server_access,
                                 Metrics& server_metrics)
    : config(server_config),
      access(server_access),
      metrics(server_metrics),
      limits(ToSessionLimits(config)),
      admission(config.max_concurrent_solves, config.max_held_result_bytes),
      setups(config.setup_cache_bytes > 0 ? std::make_unique<SetupCache>(static_cast<double>(config.setup_cache_bytes))
                                          : nullptr),
      watches("max_watches_per_user", config.access.max_watches_per_user),
      jobs(config.store.empty() ? nullptr : std::make_unique<JobBackend>(config, metrics, setups.get())),
      solvers(config.max_concurrent_solves),
      store_workers(config.store.empty() ? 0 : kStoreWorkers) {}

ProblemResolver CallEnvironment::ProblemsOf(const grpc::CallbackServerContext& call) const {
  if (jobs == nullptr) return {};
  // Looks up the caller only for requests that name a problem.
  return [this, &call](const std::string& name) -> absl::StatusOr<v1::ProblemBody> {
    const absl::StatusOr<Caller> caller = CallerOf(access, call);
    if (!caller.ok()) return caller.status();
    return jobs->library().Of(caller->user)(name);
  };
}

WorkerPool& CallEnvironment::WorkersFor(CallKind kind) { return kind == CallKind::kCompute ? solvers : store_workers; }

}  // namespace dlcs
