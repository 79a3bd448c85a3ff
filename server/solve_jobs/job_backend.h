// SPDX-License-Identifier: Apache-2.0
// The jobs and the uploaded problems of a server, without any RPC.

#ifndef DLCS_SERVER_SOLVE_JOBS_JOB_BACKEND_H_
#define DLCS_SERVER_SOLVE_JOBS_JOB_BACKEND_H_

#include <memory>

#include "core/setup_cache.h"
#include "server/config/server_config.h"
#include "server/jobs/job_manager.h"
#include "server/solve_jobs/ensemble_jobs.h"
#include "server/solve_jobs/job_solver.h"
#include "server/solve_jobs/problem_library.h"
#include "server/store/open_store.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

// The store and the objects that use it. Safe from any thread.
class JobBackend {
 public:
  // `config` is valid, resolved, and names a store. Starts the jobs in the store at once. `setups` may be null; it and
  // `metrics` must outlive the backend.
  JobBackend(const ServerConfig& config, Metrics& metrics, SetupCache* setups);

  jobs::JobManager& manager() { return manager_; }
  const jobs::JobManager& manager() const { return manager_; }
  const ProblemLibrary& library() const { return library_; }
  bool StoreHealthy() const { return store_->Healthy(); }

 private:
  const std::unique_ptr<jobs::Store> store_;
  const ProblemLibrary library_;
  const JobSolver solver_;
  const EnsembleSolver ensembles_;
  jobs::JobManager manager_;  // last: its threads use the others
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_JOB_BACKEND_H_
