// SPDX-License-Identifier: Apache-2.0
// The settings of a server. Each is a flag of dlcsd.

#ifndef DLCS_SERVER_CONFIG_SERVER_CONFIG_H_
#define DLCS_SERVER_CONFIG_SERVER_CONFIG_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "server/access/access_settings.h"
#include "server/session/solve_session.h"

namespace dlcs {

struct ServerConfig {
  // HOST:PORT, where port 0 picks a free one, or unix:/PATH. An address that other machines can reach needs TLS or
  // insecure_listen in `access`.
  std::string listen = "127.0.0.1:50051";
  // HOST:PORT of the page and of calls over HTTP/1.1 (gateway/web_port.h); empty: not served. Encrypted as `listen` is.
  std::string http_listen;
  // Lists with commas: other origins whose pages may call, and further names of this server (WebPortOptions).
  std::string http_origins;
  std::string http_hosts;
  // HOST:PORT of /metrics, /livez and /readyz over plain HTTP (telemetry/monitoring_pages.h); empty: not served.
  std::string metrics_listen;
  // Describes the services to callers that have no .proto files.
  bool reflection = false;
  AccessSettings access;

  // Solves (and single LCPs) that run at the same time; more are refused with RESOURCE_EXHAUSTED. At least 1. 0: one
  // per processor, but at least 2, so that one long solve does not block all others.
  int max_concurrent_solves = 0;
  // Threads of one solve; 0: one per processor.
  int threads = 0;

  // Larger problems are refused with RESOURCE_EXHAUSTED and the name of the limit. For dense A the time per step grows
  // like states² + constraints³, so these limits keep one request from occupying the server for days.
  std::int64_t max_states = 1'000'000;
  std::int64_t max_dense_states = 2000;
  std::int64_t max_constraints = 2000;
  std::int64_t max_steps = 20'000'000;
  std::int64_t max_result_bytes = std::int64_t{1} << 30;
  // Members of one ensemble. All are validated and held in memory as long as the ensemble runs.
  std::int64_t max_members = 100'000;
  // Bytes of all trajectories that are being computed or not yet read. At least max_result_bytes.
  std::int64_t max_held_result_bytes = std::int64_t{2} << 30;
  // The memory that one solve may allocate, as predicted by the engine.
  std::int64_t max_memory_bytes = std::int64_t{4} << 30;
  // The size of the set-up cache (core/setup_cache.h); 0: no cache.
  std::int64_t setup_cache_bytes = std::int64_t{512} << 20;
  // The job store: a file, created if it does not exist, or a PostgreSQL database that several servers share
  // (server/store/open_store.h). Empty: this server accepts no jobs. May contain a password.
  std::string store;
  // "all": serves calls and runs jobs. "front": serves calls only. "worker": runs jobs only. The latter two need a
  // shared store.
  std::string role = "all";
  // The name of this server among those that share the store. It must be the same after a restart, so that the server
  // resumes its own jobs at once. Empty: the machine's name and the port.
  std::string worker_name;
  // If a server has not renewed its leases for this long, others resume its jobs.
  std::int64_t lease_ms = 30'000;
  // A worker ends when there has been no job to claim for this long. 0: never.
  double exit_when_idle_s = 0;
  // The command that starts the ranks of a job, "mpirun -n {ranks}" (solve_jobs/rank_launcher.h); empty: this server
  // starts no ranks.
  std::string mpi_launcher;
  // The program that the launcher starts.
  std::string mpi_program = "dlcs-mpi";
  // The name or address at which ranks reach this machine. The port is a free one. Not encrypted.
  std::string mpi_host = "127.0.0.1";
  // A rank that does not respond to pings for this long counts as lost: the attempt ends, and the job is resumed.
  std::int64_t mpi_patience_ms = 30'000;
  // The largest number of ranks of one job. 0: one per processor if there is a launcher, otherwise none. A front has no
  // launcher; it admits jobs up to this limit.
  int max_ranks = 0;
  // The interval at which checkpoints of a running job are stored.
  std::int64_t checkpoint_ms = 1000;

  // Limits for jobs. A refusal names the limit. A job above max_job_core_seconds is refused for good, above the others
  // until there is room in the queue.
  double max_job_core_seconds = 24 * 3600;  // predicted
  int max_queued_jobs = 1000;
  int max_queued_jobs_per_user = 200;
  double max_queued_core_seconds = 24 * 3600;  // predicted, of all queued jobs
  // A job fails after this many attempts without progress, since it probably crashes its servers. Large, since a server
  // may also be killed for other reasons.
  int max_job_attempts = 20;
  // Finished jobs are deleted when they are older than this, or when more recent ones take up more than
  // keep_finished_bytes.
  double keep_finished_s = 7 * 24 * 3600;
  std::int64_t keep_finished_bytes = std::int64_t{10} << 30;

  // Limits for uploaded problems. An upload is held in memory until it is complete.
  std::int64_t max_upload_bytes = std::int64_t{256} << 20;
  std::int64_t max_uploaded_bytes_per_user = std::int64_t{2} << 30;
  int max_uploaded_problems_per_user = 100;
  double keep_problems_s = 7 * 24 * 3600;  // since their last use

  // Size of one request. gRPC reads it into memory before it can be checked.
  std::int64_t max_message_bytes = std::int64_t{64} << 20;
};

// Errors: InvalidArgument naming the flag, its value and the rule.
absl::Status Validate(const ServerConfig& config);

// The items of "a, b".
std::vector<std::string> SplitList(const std::string& text);

// `config` with the values of this machine in place of 0.
ServerConfig Resolved(ServerConfig config);

// The size limit of responses that are not streamed: by default clients refuse messages above 4 MB.
inline constexpr std::int64_t kMaxAnswerBytes = 3'000'000;

// The limits of one session. `config` is resolved.
SessionLimits ToSessionLimits(const ServerConfig& config);

}  // namespace dlcs

#endif  // DLCS_SERVER_CONFIG_SERVER_CONFIG_H_
