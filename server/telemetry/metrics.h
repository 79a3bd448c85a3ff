// SPDX-License-Identifier: Apache-2.0
// What a server counts and measures, in the words of Prometheus.

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

// What is read when somebody asks, since others know it anyway.
struct ServerState {
  int solves = 0;
  int max_solves = 0;
  std::int64_t held_result_bytes = 0;
  SetupCache::Statistics setups;
  // Of a server that takes jobs.
  struct Jobs {
    jobs::JobManager::Load load;
    bool store_healthy = false;
  };
  std::optional<Jobs> jobs;
};

// Safe from any thread; a count costs a mutex or two, below a microsecond. README.md of this folder has the names. No
// label holds what a caller chooses, so that their number is bounded.
class Metrics {
 public:
  using Seconds = std::chrono::duration<double>;

  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // Calls of `method` ("dlcs.v1.JobService/GetSolveJob"): begun, and ended with `code` ("NOT_FOUND") after so long.
  void CallBegan(const std::string& method);
  void CallEnded(const std::string& method, const std::string& code, Seconds took);

  // An event of a stream was given to gRPC; `lag` since it was appended.
  void EventSent(const std::string& method);
  void EventSent(const std::string& method, Seconds lag);
  // A gap was: `count` events that this reader does not get, and why ("slow").
  void GapSent(const std::string& method, const std::string& reason, std::int64_t count);

  // A solve has ended. `kind`: "call", "member" of an ensemble, or "job", of which each attempt counts what it did.
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
