// SPDX-License-Identifier: Apache-2.0
// The objects that all calls of a server share.

#ifndef DLCS_SERVER_RPC_CALL_ENVIRONMENT_H_
#define DLCS_SERVER_RPC_CALL_ENVIRONMENT_H_

#include <memory>

#include "core/setup_cache.h"
#include "grpcpp/server_context.h"
#include "server/access/access.h"
#include "server/access/user_quota.h"
#include "server/config/server_config.h"
#include "server/rpc/admission.h"
#include "server/rpc/call_registry.h"
#include "server/rpc/worker_pool.h"
#include "server/session/problem_reference.h"
#include "server/session/request_check.h"
#include "server/solve_jobs/job_backend.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

// Outlives all calls. Its parts are safe from any thread.
struct CallEnvironment {
  // `server_config` is valid and resolved. Starts the jobs in the store at once. `server_access` and `server_metrics`
  // must outlive the environment.
  CallEnvironment(const ServerConfig& server_config, const Access& server_access, Metrics& server_metrics);

  // Looks up the uploaded problems of the caller of `call`, which must outlive the returned function. An empty function
  // on a server without a store.
  ProblemResolver ProblemsOf(const grpc::CallbackServerContext& call) const;
  SetupCache::Statistics SetupStatistics() const { return setups ? setups->statistics() : SetupCache::Statistics(); }
  // The threads for the work of a call.
  WorkerPool& WorkersFor(CallKind kind);

  const ServerConfig config;
  const Access& access;
  Metrics& metrics;
  const SessionLimits limits;
  CallRegistry calls;
  Admission admission;
  const std::unique_ptr<SetupCache> setups;  // null without a cache
  UserQuota watches;
  const std::unique_ptr<JobBackend> jobs;  // null on a server without a store
  // Last: their threads use the others and are joined first.
  WorkerPool solvers;        // one thread per admitted solve
  WorkerPool store_workers;  // for calls that wait for the store
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_CALL_ENVIRONMENT_H_
