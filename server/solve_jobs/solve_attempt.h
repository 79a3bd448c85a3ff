// SPDX-License-Identifier: Apache-2.0
// One attempt at the solve of a job: the engine, whose events and checkpoints become those of the job.

#ifndef DLCS_SERVER_SOLVE_JOBS_SOLVE_ATTEMPT_H_
#define DLCS_SERVER_SOLVE_JOBS_SOLVE_ATTEMPT_H_

#include <chrono>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "server/jobs/job_manager.h"
#include "server/jobs/job_run.h"
#include "server/session/solve_session.h"
#include "server/solve_jobs/job_trajectory.h"
#include "server/store/event.h"
#include "server/store/event_detail.h"

namespace dlcs {

class SetupCache;

// Whether solves with twice and four times the step follow for the error estimate, and the work of all together
// relative to the first.
bool WillCompare(const Options& options);
inline constexpr double kWorkOfComparedSolve = 1.75;

// Receives the results of an attempt: its run (jobs::JobRun documents the functions), or a connection to the worker
// that has the run. Called from one thread.
class AttemptSink {
 public:
  virtual ~AttemptSink() = default;
  virtual void Emit(jobs::EventKind kind, std::string payload) = 0;
  virtual void Accept(jobs::AcceptedWindow window) = 0;
  virtual std::shared_ptr<const jobs::EventDetail> WantedDetail() = 0;
  virtual jobs::StopCause cause() const = 0;
};

// The stored results of earlier attempts.
struct EarlierAttempts {
  std::optional<std::string> state;  // JobRun::resume_state()
  StoredTrajectory trajectory;       // the stored part

  // The summary, if everything but the end of the job is stored; otherwise absent.
  static std::optional<std::string> SummaryIn(const std::optional<std::string>& state);
};

// Solves, with the threads in `prepared.options`; a checkpoint is made if the engine offers one and `checkpoint_every`
// has passed since the last. Ends as jobs::SolveFunction says. In a solve of several processes (core/parallel/team.h),
// `sink` is null in all of them but one. `setups` may be null.
jobs::JobEnd SolveAttempt(const PreparedSolve& prepared, EarlierAttempts earlier, AttemptSink* sink,
                          std::stop_token stop, SetupCache* setups, std::chrono::milliseconds checkpoint_every);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_SOLVE_ATTEMPT_H_
