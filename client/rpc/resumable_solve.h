// SPDX-License-Identifier: Apache-2.0
// A solve whose events may come from several calls.

#ifndef DLCS_CLIENT_RPC_RESUMABLE_SOLVE_H_
#define DLCS_CLIENT_RPC_RESUMABLE_SOLVE_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "client/result/backend.h"
#include "client/result/solve_result.h"
#include "client/rpc/job_client.h"

namespace dlcs::client {

// Passes every event to a collector and a callback exactly once. Not thread-safe.
class ResumableSolve {
 public:
  // All must outlive it; `on_event` may be empty.
  ResumableSolve(ResultCollector& collector, const EventCallback& on_event)
      : collector_(collector), on_event_(on_event) {}

  // Takes an event of the call that started the solve.
  void Take(const v1::SolveEvent& event);

  // The name of its job; empty if it does not run as a job, or not known yet.
  const std::string& job() const { return job_; }

  // Reads the remaining events, trajectory and summary from the job. Errors: those of JobClient; that of a job that
  // failed without a summary.
  absl::Status Resume(JobClient& jobs, const CallLimits& limits);

 private:
  absl::Status Watch(JobClient& jobs, const CallLimits& limits);
  absl::Status ReadTrajectory(JobClient& jobs, const CallLimits& limits);

  ResultCollector& collector_;
  const EventCallback& on_event_;
  std::string job_;
  std::int64_t last_sequence_ = 0;
  std::int64_t times_ = 0;  // number of times of the trajectory received so far
  double last_time_ = 0;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_RESUMABLE_SOLVE_H_
