// SPDX-License-Identifier: Apache-2.0
// The metrics of a server, in the text format of Prometheus.

#ifndef DLCS_SERVER_TELEMETRY_METRICS_H_
#define DLCS_SERVER_TELEMETRY_METRICS_H_

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/problem/solution.h"
#include "core/setup_cache.h"
#include "server/jobs/job_manager.h"
#include "server/store/store_timer.h"

namespace dlcs {

// Values that other objects hold, read when metrics are requested.
struct ServerState {
  int solves = 0;
  int max_solves = 0;
  std::int64_t held_result_bytes = 0;
  int web_connections = 0;  // of the page and of calls over HTTP
  SetupCache::Statistics setups;
  // Of a server that takes jobs.
  struct Jobs {
    jobs::JobManager::Load load;
    bool store_healthy = false;
  };
  std::optional<Jobs> jobs;
};

// Safe from any thread; a count costs a mutex or two, below a microsecond. README.md of this folder lists the names. No
// label value is chosen by callers, so their number is bounded.
class Metrics {
 public:
  using Seconds = std::chrono::duration<double>;

  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // A call of `method` ("dlcs.v1.JobService/GetSolveJob") began, or ended with `code` ("NOT_FOUND") after the given
  // time.
  void CallBegan(const std::string& method);
  void CallEnded(const std::string& method, const std::string& code, Seconds took);

  // An event of a stream was passed to gRPC, `lag` after it was appended.
  void EventSent(const std::string& method);
  void EventSent(const std::string& method, Seconds lag);
  // A gap was sent: this reader does not receive `count` events, because of `reason` ("slow").
  void GapSent(const std::string& method, const std::string& reason, std::int64_t count);

  // A solve has ended. `kind`: "call", "member" (of an ensemble) or "job" (each attempt counts separately).
  void Solved(const std::string& kind, const std::string& method, const std::string& termination, const Cost& cost);
  // An attempt at a job has ended: "succeeded", "failed", "cancelled", or "interrupted", to be resumed.
  void JobEnded(const std::string& outcome);

  // For the options of a store.
  jobs::StoreTimer StoreTimer();

  // All of it in the text format that Prometheus reads.
  std::string Text(const ServerState& state) const;

 private:
  struct Families;
  const std::unique_ptr<Families> families_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_METRICS_H_
