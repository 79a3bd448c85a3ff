// SPDX-License-Identifier: Apache-2.0
// One attempt at a job: the interface between the solve function and the service.

#ifndef DLCS_SERVER_JOBS_JOB_RUN_H_
#define DLCS_SERVER_JOBS_JOB_RUN_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "server/jobs/event_log.h"
#include "server/store/job.h"
#include "server/store/job_store.h"

namespace dlcs::jobs {

enum class StopCause {
  kNone,
  kCancelled,  // by its user
  kDeadline,
  kDrain,      // the server shuts down: another one resumes the job from its last accepted window
  kLeaseLost,  // another server has the job
};

// A window that never needs to be solved again.
struct AcceptedWindow {
  double begin = 0;
  double end = 0;
  std::string trajectory;  // this part of it
  // The state to resume from after this window. Absent: the next attempt resumes from the earlier state and finds this
  // part in the store already.
  std::optional<std::string> state;
  std::string event;    // payload of kWindowAccepted
  double progress = 0;  // of the whole, 0 to 1
};

// The functions for the solve function may be called from one thread at a time. They never wait for the store or for
// watchers: each holds a mutex only while it appends. Accepted data that are not yet stored are held in memory, at most
// one copy of the trajectory.
class JobRun : public std::enable_shared_from_this<JobRun> {
 public:
  // Called with the run when there is something to Write(); not called again before Write(). Must not block.
  using WriteRequest = std::function<void(std::weak_ptr<JobRun>)>;
  // Made by std::make_shared.
  JobRun(ClaimedJob job, int threads, std::shared_ptr<EventLog> log, WriteRequest request_write);

  // For the solve function. -------------------------------------------------------------------------------------------

  const JobId& id() const { return job_.job.id; }
  const std::string& body() const { return job_.body; }
  // The state after the last accepted window; absent on a first attempt. The function must resume from it so that the
  // trajectory has the same bits as without the interruption.
  const std::optional<std::string>& resume_state() const { return job_.resume_state; }
  std::int64_t num_accepted() const { return job_.job.chunks; }
  // The input of the shard to solve, if the job is an ensemble; absent for a solve. A run of a shard must not Emit()
  // nor Accept().
  const std::optional<std::string>& shard_input() const { return job_.shard_input; }
  int threads() const { return threads_; }
  std::stop_token stop() const { return stop_source_.get_token(); }
  StopCause cause() const { return cause_; }

  // The detail that the current watchers want in iterates. Never null.
  std::shared_ptr<const EventDetail> WantedDetail() const { return log_->WantedDetail(); }
  // Emits an event of any kind except kState, kWindowAccepted and kSummary, which other functions emit.
  void Emit(EventKind kind, std::string payload);
  void Accept(AcceptedWindow window);

  // For the service. --------------------------------------------------------------------------------------------------

  // The first cause is kept. Safe from any thread.
  void Stop(StopCause cause);
  // Emits the event that the job is being cancelled, once. Safe from any thread.
  void ReportCancelling();

  // Writes accepted windows and emitted events into the store, and reserves numbers if needed. Safe from any thread.
  // Errors: those of JobStore::Append(); what could not be written is written by the next call.
  absl::Status Write(JobStore& store);
  // Calls Write() until nothing is left, then ends the job with the given state and its final events.
  absl::Status Finish(JobStore& store, JobState state, const absl::Status& error, const std::string& summary,
                      const std::string& tally);
  // The same, but releases the job so that another attempt can resume it; `in_vain` as in JobStore.
  absl::Status Release(JobStore& store, bool in_vain);

  const Job& job() const { return job_.job; }
  const Lease& lease() const { return job_.lease; }
  bool is_shard() const { return job_.lease.shard.has_value(); }
  const std::shared_ptr<EventLog>& log() const { return log_; }

 private:
  // With pending_mutex_ held, so that events are pending in the order of their numbers.
  void AppendDurable(EventKind kind, std::string payload);
  void RequestWrite();

  const ClaimedJob job_;
  const int threads_;
  const std::shared_ptr<EventLog> log_;
  const WriteRequest request_write_;
  std::atomic<StopCause> cause_{StopCause::kNone};
  std::stop_source stop_source_;
  std::atomic<bool> write_requested_{false};

  std::mutex pending_mutex_;  // held only briefly: the engine takes it
  Progress pending_;
  std::int64_t next_chunk_;
  bool reported_cancelling_ = false;

  std::mutex write_mutex_;  // held during writes; taken before pending_mutex_
  Progress unwritten_;      // the data of a failed Write()
  std::optional<Outcome> outcome_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_JOB_RUN_H_
