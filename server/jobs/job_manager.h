// SPDX-License-Identifier: Apache-2.0
// The life of jobs on one server: admission, queue, runs, watchers, restarts, end.

#ifndef DLCS_SERVER_JOBS_JOB_MANAGER_H_
#define DLCS_SERVER_JOBS_JOB_MANAGER_H_

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/jobs/checkpoint_writer.h"
#include "server/jobs/event_log.h"
#include "server/jobs/event_relay.h"
#include "server/jobs/job_run.h"
#include "server/jobs/job_watch.h"
#include "server/jobs/scheduler.h"
#include "server/jobs/watch_dispatcher.h"
#include "server/store/clock.h"
#include "server/store/job.h"
#include "server/store/job_store.h"

namespace dlcs::jobs {

// How an attempt ended, as the solve function reports it:
//   OK           the work is done: SUCCEEDED, even if a stop was requested at the last moment;
//   CANCELLED    it was stopped; the new state of the job depends on the cause;
//   UNAVAILABLE  it could not read its data from the store, and has emitted nothing yet: it is called again until it
//                can or is stopped;
//   ABORTED      processes that it needs failed: QUEUED again, since another attempt may succeed;
//   any other    FAILED.
// `summary` is the payload of the last event, if there is one.
struct JobEnd {
  absl::Status status;
  std::string summary;
  ShardResult shard = {};  // instead of the summary, where the run is of a shard of an ensemble and the status is OK
  std::string tally = {};  // Job::tally of a solve
};

using SolveFunction = std::function<JobEnd(JobRun& run)>;

struct Submission {
  std::string owner;
  std::string request_id;
  std::string body_hash;
  std::string body;
  std::string problem;  // as NewJob::problem
  std::string about;    // as NewJob::about
  int priority = 0;
  std::optional<Time> deadline;
  std::vector<std::string> shards = {};  // as NewJob::shards
  std::optional<Demand> demand = {};     // where it is known without the cost model
};

// The predicted demand of a job. An error refuses the job.
using CostModel = std::function<absl::StatusOr<Demand>(const Submission& submission)>;

struct JobManagerOptions {
  SchedulerLimits limits;
  EventLogLimits log;
  // False for a server that does not run jobs itself; limits.cores are then those of the other servers.
  bool runs_jobs = true;
  // Whether this server can run a job with this Job::about. It leaves others to servers that can. Called with a lock
  // held, and for queued jobs again and again.
  std::function<bool(const std::string& about)> can_run = [](const std::string&) { return true; };
  // The name of this server among those that share the store; the same after a restart, so that it finds its jobs.
  std::string worker = "dlcsd";
  Duration lease = std::chrono::seconds(30);  // renewed every quarter of it
  Duration poll = std::chrono::seconds(1);    // interval of polling for changes that the store does not announce
  Duration probe = std::chrono::seconds(5);   // interval of checking whether the store works
  // How often this server requests transient events, of jobs that are watched here, from others.
  Duration ask = std::chrono::seconds(5);
  Duration expire_every = std::chrono::seconds(60);
  Expiry expiry;
  // A job fails after this many attempts without progress, since it probably crashes its servers. Large, since a server
  // may also be killed for other reasons.
  int max_attempts = 20;
};

// Joins store, scheduler and event logs. Safe from any thread. Functions that return a status block on the store: never
// call them from a reaction. `owner` as in JobStore.
class JobManager {
 public:
  // Resumes the jobs that an earlier process of this worker left, and, with options.runs_jobs, starts the threads that
  // run jobs: limits.cores, those for small jobs, and some for jobs that wait for the store at their end. All
  // references must outlive it. `solve` is called from those threads; it may throw.
  JobManager(JobManagerOptions options, JobStore& store, CostModel cost, SolveFunction solve, const Clock& clock);
  // Drain(0).
  ~JobManager();

  // Checks a new job as Submit() does, and returns its predicted demand; stores nothing.
  absl::StatusOr<Demand> Check(const Submission& submission) const;
  // OK if there is a place in the queue for a new job of `owner`; otherwise RESOURCE_EXHAUSTED with RefusalOf(), or
  // UNAVAILABLE while draining. Cheap, so that a job can be refused before its request is read. Does not block.
  absl::Status CheckQueueSpace(const std::string& owner) const;
  // OK: the job is in the store. Errors: of `cost`; RESOURCE_EXHAUSTED with RefusalOf(); ALREADY_EXISTS; UNAVAILABLE
  // while draining.
  absl::StatusOr<JobStore::Created> Submit(const Submission& submission);
  absl::StatusOr<Job> Cancel(const std::optional<std::string>& owner, const JobId& id);
  absl::Status Delete(const std::optional<std::string>& owner, const JobId& id);
  // The watch must be destroyed before the manager. Errors: NOT_FOUND; OUT_OF_RANGE when options.after is a number that
  // no event has.
  absl::StatusOr<std::unique_ptr<JobWatch>> Watch(const std::optional<std::string>& owner, const JobId& id,
                                                  const EventWatchOptions& options, std::function<void()> ready);

  // Starts no more jobs. Running jobs may end within `grace`; then they are stopped and released to the store with
  // their accepted windows. Returns when no job runs. If the store does not answer, it stops waiting after two more
  // seconds: then the leases remain until a restart or until they expire.
  void Drain(Duration grace);

  // Whether the store answers and the manager is not draining.
  bool Healthy() const;
  struct Load {
    // What this server knows; of all that share the store, as of the last poll, where that is measured.
    std::int64_t queued = 0;
    double queued_core_seconds = 0;
    Duration oldest_queued_age{};
    // Not at the first call, nor while the store does not answer.
    bool is_measured = false;
    int running = 0;
  };
  Load load() const;
  // For how long there has been nothing to run, here or to be claimed from the store. A store that does not answer may
  // have jobs, so that the time begins again when it does.
  Duration idle_for() const;
  // Whether this server itself would run a job with this Job::about.
  bool CanRun(const std::string& about) const { return options_.runs_jobs && options_.can_run(about); }
  JobStore& store() { return store_; }
  const JobManagerOptions& options() const { return options_; }

 private:
  // A job whose lease this server has or is about to get.
  struct Active {
    std::shared_ptr<JobRun> run;  // null while it is being claimed
    bool cancelled = false;       // it was cancelled while it was being claimed
  };

  // A request of another server for events of a job that is watched there.
  struct RemoteWatch {
    Duration until;
    EventDetail detail;
  };

  static constexpr const char* kDeadlineOfEnsemble = "The deadline passed before all members were solved.";

  absl::StatusOr<Demand> DemandOf(const Submission& submission) const;

  void Work();
  // The request to queue next: the ensemble again, if this was a shard of one.
  std::optional<Scheduler::Request> RunJob(Scheduler::Start& start);
  // Claims the job of `start`. If another server has it, claims an alternative and makes that `start`. Null if other
  // servers have all alternatives too, or if the store does not respond.
  std::shared_ptr<JobRun> Begin(Scheduler::Start& start);
  // The first of `start` and its alternatives that can be claimed.
  std::optional<ClaimedJob> Claim(Scheduler::Start& start);
  JobEnd Solve(JobRun& run);
  void End(JobRun& run, const JobEnd& end);
  // Discards the events of the run that are not in the store.
  static void Abandon(JobRun& run);
  // Repeats `write` until it succeeds, the lease is lost, or the server shuts down.
  void Persist(JobRun& run, const std::function<absl::Status()>& write);
  // Waits for `pause` before the store is called again, and lengthens it. Returns at once if the manager no longer
  // waits for the store.
  void WaitForStore(std::chrono::milliseconds& pause);

  void RunMaintenance();
  void ReclaimJobs();
  void MeasureQueue();
  void FollowRemoteJobs();
  void FollowRemoteJob(const JobId& id);
  // Asks the servers that run the jobs watched here for events that are not in the store.
  void PublishInterest();
  void RenewLeases();
  void RenewLease(JobRun& run);
  // Called by the store's thread: wakes the housekeeper to handle `change` now instead of at its next poll.
  void OnStoreChange(const JobChange& change);
  void Refresh(const JobId& id);
  // With mutex_ held: whether the events of this job come from a run here. Those of an ensemble come from the store.
  bool HasEventsOf(const JobId& id) const;
  // With mutex_ held: whether to poll the store now.
  bool ShouldPoll() const;
  void EnforceDeadlines();
  void FailUnmeetable();
  std::vector<std::shared_ptr<JobRun>> Runs() const;
  std::optional<Time> NextDeadline() const;

  std::shared_ptr<EventLog> LogOf(const Job& job);
  Scheduler::Request RequestOf(const Job& job) const;
  Scheduler::Request RequestOf(const NewJob& job) const;

  const JobManagerOptions options_;
  JobStore& store_;
  const CostModel cost_;
  const SolveFunction solve_;
  const Clock& clock_;
  WatchDispatcher dispatcher_;
  CheckpointWriter writer_;
  EventRelay relay_;

  mutable std::mutex mutex_;
  std::condition_variable work_;   // a job may start, or the manager ends
  std::condition_variable house_;  // the housekeeper has something to do
  std::condition_variable idle_;   // nothing runs
  Scheduler scheduler_;
  std::map<JobId, Active> active_;
  std::optional<QueueDepth> depth_;        // of the store, as of the last poll
  Duration depth_read_{};                  // when that was
  mutable Duration depth_wanted_until_{};  // load() was called some time before
  Duration idle_since_;                    // the last time that there was, or may have been, something to run
  std::map<JobId, std::weak_ptr<EventLog>> logs_;
  // Notifications from the store: jobs that changed, that there are jobs to claim, and any notification at all.
  std::set<JobId> changed_jobs_;
  bool work_announced_ = false;
  bool was_notified_ = false;
  std::int64_t cancels_ = 0;  // number of requests received to stop jobs that do not run here
  std::map<JobId, RemoteWatch> watched_elsewhere_;
  bool interest_changed_ = false;  // a watch of a job that does not run here began
  std::atomic<bool> leases_released_ = false;
  bool draining_ = false;
  bool abandoning_ = false;  // the manager no longer waits for the store
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_JOB_MANAGER_H_
