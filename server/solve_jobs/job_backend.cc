// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/job_backend.h"

#include <chrono>

#include "server/solve_jobs/job_limits.h"
#include "server/telemetry/job_telemetry.h"
#include "spdlog/spdlog.h"

namespace dlcs {

JobBackend::JobBackend(const ServerConfig& config, Metrics& metrics, SetupCache* setups)
    : store_(jobs::OpenStore(config.store, metrics.StoreTimer())),
      library_(*store_, ToUploadLimits(config), ToSessionLimits(config)),
      solver_(ToJobLimits(config), setups, *store_, library_, std::chrono::milliseconds(config.checkpoint_ms),
              RankSettingsOf(config)),
      ensembles_(ToSessionLimits(config), setups, library_, metrics),
      manager_(
          ToJobManagerOptions(config), *store_,
          [this](const jobs::Submission& submission) { return solver_.Predict(submission.owner, submission.body); },
          WithTelemetry(
              metrics,
              [this](jobs::JobRun& run) { return run.is_shard() ? ensembles_.Solve(run) : solver_.Solve(run); }),
          jobs::SystemClock()) {
  spdlog::info("jobs in {}, role {}, named {}", jobs::DescribeStore(config.store), config.role,
               manager_.options().worker);
}

}  // namespace dlcs
