// SPDX-License-Identifier: Apache-2.0
// The settings of a server. Each is a flag of dlcsd.

#ifndef DLCS_SERVER_CONFIG_SERVER_CONFIG_H_
#define DLCS_SERVER_CONFIG_SERVER_CONFIG_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "server/access/access_settings.h"
#include "server/session/solve_session.h"

namespace dlcs {

struct ServerConfig {
  // HOST:PORT; port 0 picks a free one. For other machines than this one, `access` has to say how.
  std::string listen = "127.0.0.1:50051";
  // HOST:PORT of /metrics, /livez and /readyz over plain HTTP (telemetry/http_endpoint.h); empty: nothing listens.
  std::string metrics_listen;
  // Describes the services to callers that have no .proto files.
  bool reflection = false;
  AccessSettings access;

  // Solves (and single LCPs) under way at once; more are refused with RESOURCE_EXHAUSTED. At least 1.
  // 0 takes one per processor, but at least 2, so that one long solve does not shut everybody else out.
  int max_concurrent_solves = 0;
  // Threads of one solve; 0 takes all processors.
  int threads = 0;

  // Refused above, with RESOURCE_EXHAUSTED and the limit's name. Time per step grows like states² +
  // constraints³ where A is written down entry by entry, so these keep one request from occupying the server
  // for days.
  std::int64_t max_states = 1'000'000;
  std::int64_t max_dense_states = 2000;
  std::int64_t max_constraints = 2000;
  std::int64_t max_steps = 20'000'000;
  std::int64_t max_result_bytes = std::int64_t{1} << 30;
  // Members of one ensemble. Each is checked and held for as long as the ensemble runs.
  std::int64_t max_members = 100'000;
  // Of all trajectories that are being computed or waiting for their readers. At least max_result_bytes.
  std::int64_t max_held_result_bytes = std::int64_t{2} << 30;
  // What one solve may allocate, as the engine predicts it.
  std::int64_t max_memory_bytes = std::int64_t{4} << 30;
  // Of what solves of the same matrices share (core/setup_cache.h); 0 keeps nothing.
  std::int64_t setup_cache_bytes = std::int64_t{512} << 20;
  // Where jobs are kept: a file, made where there is none, or a PostgreSQL database that several servers share
  // (server/store/open_store.h). Empty: this server takes no jobs. May hold a password.
  std::string store;
  // "all": takes calls and runs jobs. "front": takes calls, and leaves jobs to others. "worker": runs jobs and takes no
  // calls. The latter two need a shared store.
  std::string role = "all";
  // Of this server among those that share the store, the same after a restart, so that it takes up its own jobs at
  // once. Empty: the machine's name and the port.
  std::string worker_name;
  // The jobs of a server that was not heard of for so long are taken up by others.
  std::int64_t lease_ms = 30'000;
  // What a running job has found is stored about so often.
  std::int64_t checkpoint_ms = 1000;

  // Jobs, where there is a store. What is refused above them names the limit; the first never, the others until there
  // is room.
  double max_job_core_seconds = 24 * 3600;  // predicted
  int max_queued_jobs = 1000;
  int max_queued_jobs_per_user = 200;
  double max_queued_core_seconds = 24 * 3600;  // predicted, of all
  // A job that was begun so often without getting on ends the servers it runs on, and is given up. Large, since a
  // server may also be killed for other reasons before a job gets on.
  int max_job_attempts = 20;
  // Jobs that have ended are forgotten when they are older, or when those that ended later hold so much.
  double keep_finished_s = 7 * 24 * 3600;
  std::int64_t keep_finished_bytes = std::int64_t{10} << 30;

  // Uploaded problems, where there is a store. An upload is held in memory while it comes.
  std::int64_t max_upload_bytes = std::int64_t{256} << 20;
  std::int64_t max_uploaded_bytes_per_user = std::int64_t{2} << 30;
  int max_uploaded_problems_per_user = 100;
  double keep_problems_s = 7 * 24 * 3600;  // since their last use

  // Of one request. gRPC holds it in memory before anybody can look at it.
  std::int64_t max_message_bytes = std::int64_t{64} << 20;
};

// Errors: InvalidArgument naming the flag, its value and the rule.
absl::Status Validate(const ServerConfig& config);

// `config` with the numbers of this machine in place of 0.
ServerConfig Resolved(ServerConfig config);

// Of an answer that is not streamed: receivers refuse messages above 4 MB unless they were told otherwise.
inline constexpr std::int64_t kMaxAnswerBytes = 3'000'000;

// The part that one session is told. `config` is resolved.
SessionLimits ToSessionLimits(const ServerConfig& config);

}  // namespace dlcs

#endif  // DLCS_SERVER_CONFIG_SERVER_CONFIG_H_
