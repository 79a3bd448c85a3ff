// SPDX-License-Identifier: Apache-2.0
// One attempt at a job: what the solve function sees of the service, and what the service sees of it.

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
  kDrain,      // the server ends: the job goes on elsewhere, from its last accepted window
  kLeaseLost,  // somebody else has the job
};

// A window that needs never be solved again.
struct AcceptedWindow {
  double begin = 0;
  double end = 0;
  std::string trajectory;  // this part of it
  // To go on from behind it. Absent: the next attempt goes on from the state before, and finds this part there already.
  std::optional<std::string> state;
  std::string event;       // payload of kWindowAccepted
  double progress = 0;     // of the whole, 0 to 1
};

// The solve function's side may be called from one thread at a time, and never waits for the store or for watchers:
// each call takes a mutex for as long as it takes to append. What was accepted and is not yet stored is held in memory;
// it is at most the trajectory once more.
class JobRun : public std::enable_shared_from_this<JobRun> {
 public:
  // Called with the run when there is something to Write(), once until that was called. Must not block.
  using AskForWriting = std::function<void(std::weak_ptr<JobRun>)>;
  // Made by std::make_shared.
  JobRun(ClaimedJob job, int threads, std::shared_ptr<EventLog> log, AskForWriting ask_for_write);

  // For the solve function. -------------------------------------------------------------------------------------------

  const JobId& id() const { return job_.job.id; }
  const std::string& body() const { return job_.body; }
  // What the last accepted window left, and how many there were; absent on a first attempt. The function must go on
  // from there so that the trajectory has the same bits as without the interruption.
  const std::optional<std::string>& resume_state() const { return job_.resume_state; }
  std::int64_t num_accepted() const { return job_.job.chunks; }
  int threads() const { return threads_; }
  std::stop_token stop() const { return stop_source_.get_token(); }
  StopCause cause() const { return cause_; }

  // What iterates are to carry for the watchers there are now. Never null.
  std::shared_ptr<const EventDetail> WantedDetail() const { return log_->WantedDetail(); }
  // Of any kind but kState, kWindowAccepted and kSummary, which come about otherwise.
  void Emit(EventKind kind, std::string payload);
  void Accept(AcceptedWindow window);

  // For the service. --------------------------------------------------------------------------------------------------

  // The first cause stays. Safe from any thread.
  void Stop(StopCause cause);
  // Tells watchers that the job was asked to stop. Safe from any thread; says it once.
  void SayCancelling();

  // Brings what was accepted and emitted into the store, with a reservation of numbers where one is needed. Safe from
  // any thread. Errors: of JobStore::Append(); what could not be written is written by the next call.
  absl::Status Write(JobStore& store);
  // Write() until nothing is left, then ends the job with `outcome`, whose events are made here.
  absl::Status Finish(JobStore& store, JobState state, const absl::Status& error, const std::string& summary);
  // The same, but gives the job back.
  absl::Status Release(JobStore& store);

  const Job& job() const { return job_.job; }
  const Lease& lease() const { return job_.lease; }
  const std::shared_ptr<EventLog>& log() const { return log_; }

 private:
  // With pending_mutex_ held, so that events are pending in the order of their numbers.
  void AppendKept(EventKind kind, std::string payload);
  void AskForWrite();

  const ClaimedJob job_;
  const int threads_;
  const std::shared_ptr<EventLog> log_;
  const AskForWriting ask_for_write_;
  std::atomic<StopCause> cause_{StopCause::kNone};
  std::stop_source stop_source_;
  std::atomic<bool> asked_{false};

  std::mutex pending_mutex_;  // short: the engine takes it
  Progress pending_;
  std::int64_t next_chunk_;
  bool said_cancelling_ = false;

  std::mutex write_mutex_;  // long: one writer at a time; taken before pending_mutex_
  Progress unwritten_;      // what a failed Write() left
  std::optional<Outcome> outcome_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_JOB_RUN_H_
