// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/job_limits.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "fmt/format.h"
#include "server/jobs/event_log.h"
#include "server/solve_jobs/convert_job.h"
#include "server/store/open_store.h"

namespace dlcs {
namespace {

jobs::Duration FromSeconds(double seconds) {
  return std::chrono::duration_cast<jobs::Duration>(std::chrono::duration<double>(seconds));
}

google::protobuf::Duration ToProto(jobs::Duration duration) {
  const auto us = duration.count();
  google::protobuf::Duration result;
  result.set_seconds(us / 1'000'000);
  result.set_nanos(static_cast<int>(us % 1'000'000) * 1000);
  return result;
}

std::string WorkerName(const ServerConfig& config) {
  if (!config.worker_name.empty()) return config.worker_name;
  char host[256] = {};
  gethostname(host, sizeof host - 1);
  const std::string port = config.listen.substr(config.listen.rfind(':') + 1);
  // A free port differs after a restart: then the jobs of this process are resumed when their leases expire.
  return fmt::format("{}:{}", host, port == "0" ? fmt::format("pid-{}", getpid()) : port);
}

}  // namespace

jobs::JobManagerOptions ToJobManagerOptions(const ServerConfig& config) {
  jobs::JobManagerOptions options;
  options.runs_jobs = config.role != "front";
  if (jobs::IsShared(config.store)) options.worker = WorkerName(config);
  options.can_run = [most = config.max_ranks](const std::string& about) { return RanksOf(about) <= most; };
  options.lease = std::chrono::milliseconds(config.lease_ms);
  jobs::SchedulerLimits& limits = options.limits;
  limits.cores = config.threads;
  limits.max_threads_per_job = config.threads;
  limits.max_running_memory_bytes = config.max_memory_bytes + config.max_held_result_bytes;
  limits.max_job_memory_bytes = limits.max_running_memory_bytes;
  limits.max_job_core_seconds = config.max_job_core_seconds;
  limits.max_queued_jobs = config.max_queued_jobs;
  limits.max_queued_jobs_per_user = config.max_queued_jobs_per_user;
  limits.max_queued_core_seconds = config.max_queued_core_seconds;
  limits.cores_kept_for_small = std::min(1, config.threads - 1);
  limits.burst_cores = std::max(1, config.threads / 4);
  options.max_attempts = config.max_job_attempts;
  options.expiry.max_age = FromSeconds(config.keep_finished_s);
  options.expiry.max_finished_bytes = config.keep_finished_bytes;
  options.expiry.max_unused_problem_age = FromSeconds(config.keep_problems_s);
  // So often that jobs with a short retention time are not kept much longer.
  options.expire_every =
      std::clamp<jobs::Duration>(std::min(options.expiry.max_age, options.expiry.max_unused_problem_age) / 10,
                                 std::chrono::milliseconds(100), options.expire_every);
  return options;
}

RankSettings RankSettingsOf(const ServerConfig& config) {
  return {.launcher = config.mpi_launcher,
          .program = config.mpi_program,
          .host = config.mpi_host,
          .patience = std::chrono::milliseconds(config.mpi_patience_ms)};
}

SessionLimits ToJobLimits(const ServerConfig& config) {
  SessionLimits limits = ToSessionLimits(config);
  limits.max_ranks = config.max_ranks;
  return limits;
}

UploadLimits ToUploadLimits(const ServerConfig& config) {
  return {
      .max_upload_bytes = config.max_upload_bytes,
      .quota = {.max_bytes = config.max_uploaded_bytes_per_user, .max_problems = config.max_uploaded_problems_per_user},
      .keep_unused = FromSeconds(config.keep_problems_s)};
}

v1::JobLimits JobLimitsToProto(const jobs::JobManagerOptions& options, int max_ranks) {
  v1::JobLimits result;
  result.set_max_job_memory_bytes(options.limits.max_job_memory_bytes);
  result.set_max_job_core_seconds(options.limits.max_job_core_seconds);
  result.set_max_priority(kMaxPriority);
  result.set_max_queued_jobs(options.limits.max_queued_jobs);
  result.set_max_queued_jobs_per_user(options.limits.max_queued_jobs_per_user);
  result.set_max_queued_core_seconds(options.limits.max_queued_core_seconds);
  result.set_cores(options.limits.cores);
  result.set_max_attempts(options.max_attempts);
  *result.mutable_keep_finished() = ToProto(options.expiry.max_age);
  result.set_keep_finished_bytes(options.expiry.max_finished_bytes);
  *result.mutable_max_watch_interval() = ToProto(kMaxWatchInterval);
  *result.mutable_heartbeat_interval() = ToProto(jobs::EventWatchOptions().heartbeat);
  result.set_max_ranks(max_ranks);
  return result;
}

v1::UploadLimits UploadLimitsToProto(const ServerConfig& config) {
  const UploadLimits limits = ToUploadLimits(config);
  v1::UploadLimits result;
  result.set_max_upload_bytes(limits.max_upload_bytes);
  result.set_max_uploaded_bytes_per_user(limits.quota.max_bytes);
  result.set_max_uploaded_problems_per_user(limits.quota.max_problems);
  *result.mutable_keep_unused() = ToProto(limits.keep_unused);
  return result;
}

}  // namespace dlcs
