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
//   OK           the work is done: SUCCEEDED, even if a stop came at the last moment;
//   CANCELLED    it was stopped; what becomes of the job depends on who stopped it;
//   UNAVAILABLE  it could not read what it needs from the store, and has emitted nothing yet: it is called again,
//                until it can or is stopped;
//   any other    FAILED.
// `summary` is the payload of the last event, if there is one.
struct JobEnd {
  absl::Status status;
  std::string summary;
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
};

// What the job will need. Errors refuse it.
using CostModel = std::function<absl::StatusOr<Demand>(const Submission& submission)>;

struct JobManagerOptions {
  SchedulerLimits limits;
  EventLogLimits log;
  // False for a server that admits, answers and lets others run; limits.cores are then those of the others.
  bool runs_jobs = true;
  // Of this server among those that share the store; the same after a restart, so that it finds its jobs at once.
  std::string worker = "dlcsd";
  Duration lease = std::chrono::seconds(30);  // renewed every quarter of it
  Duration poll = std::chrono::seconds(1);    // how soon what other servers did is seen where the store does not tell
  Duration probe = std::chrono::seconds(5);   // how soon a store that broke, or came back, is noticed
  // How often others are asked to tell what passes in jobs that are watched here.
  Duration ask = std::chrono::seconds(5);
  Duration expire_every = std::chrono::seconds(60);
  Expiry expiry;
  // A job that was begun so often without getting on ends the servers it runs on, and is given up. Large, since a
  // server may also be killed for other reasons before a job gets on.
  int max_attempts = 20;
};

// Joins store, scheduler and event logs. Safe from any thread. Functions that return a status block on the store: never
// call them from a reaction. `owner` as in JobStore.
class JobManager {
 public:
  // Takes up at once the jobs that an earlier life of this worker left, and starts threads that run jobs, as many as
  // limits.cores and those lent and some whose jobs wait for the store at their end (options.runs_jobs). All references
  // must outlive it. `solve` is called from those threads; it may throw.
  JobManager(JobManagerOptions options, JobStore& store, CostModel cost, SolveFunction solve, const Clock& clock);
  // Drain(0).
  ~JobManager();

  // What Submit() would say of a new job, and what it is predicted to need; takes nothing.
  absl::StatusOr<Demand> Check(const Submission& submission) const;
  // What Submit() would say at once to a new job of `owner`, whatever it is: that there is no place for it
  // (RESOURCE_EXHAUSTED with RefusalOf()), or UNAVAILABLE while draining. Costs nothing, and so refuses what need not
  // even be read. Does not block.
  absl::Status CheckPlaces(const std::string& owner) const;
  // OK: the job is in the store. Errors: of `cost`; RESOURCE_EXHAUSTED with RefusalOf(); ALREADY_EXISTS; UNAVAILABLE
  // while draining.
  absl::StatusOr<JobStore::Created> Submit(const Submission& submission);
  absl::StatusOr<Job> Cancel(const std::optional<std::string>& owner, const JobId& id);
  absl::Status Delete(const std::optional<std::string>& owner, const JobId& id);
  // What is returned must be gone before the manager is. Errors: NOT_FOUND; OUT_OF_RANGE when options.after is a number
  // that no event has.
  absl::StatusOr<std::unique_ptr<JobWatch>> Watch(const std::optional<std::string>& owner, const JobId& id,
                                                  const EventWatchOptions& options, std::function<void()> ready);

  // Nothing starts any more; what runs may end within `grace`, and is then stopped and given back to the store with
  // what was accepted. Returns when nothing runs. A store that does not answer is given up after two seconds more:
  // then the leases stand until a restart or their end.
  void Drain(Duration grace);

  // The store answers, and nobody drains.
  bool Healthy() const;
  struct Load {
    int queued = 0;
    int running = 0;
    double queued_core_seconds = 0;
  };
  Load load() const;
  JobStore& store() { return store_; }
  const JobManagerOptions& options() const { return options_; }

 private:
  // A job of which this server has, or is about to get, the lease.
  struct Active {
    std::shared_ptr<JobRun> run;  // null while it is being claimed
    bool cancelled = false;       // meanwhile
  };

  // What was heard of a job that others watch.
  struct Audience {
    Duration until;
    EventDetail detail;
  };

  void Work();
  void RunJob(const Scheduler::Start& start);
  // Null when somebody else has it, or the store does not answer.
  std::shared_ptr<JobRun> Begin(const Scheduler::Start& start);
  JobEnd Solve(JobRun& run);
  void End(JobRun& run, const JobEnd& end);
  // `write` until it succeeds, the lease is lost, or the server cannot wait.
  void Persist(JobRun& run, const std::function<absl::Status()>& write);
  // Before it is asked again; the next pause is longer. Ends at once where it is not waited for any more.
  void WaitForStore(std::chrono::milliseconds& pause);

  void RunMaintenance();
  void ReclaimJobs();
  void FollowOthers();
  void FollowOther(const JobId& id);
  // Asks who runs the jobs that are watched here to tell what is not in the store.
  void AskOthers();
  void RenewLeases();
  void RenewLease(JobRun& run);
  // From the store's thread: makes the housekeeper look now at what it would look at later.
  void OnStoreChange(const JobChange& change);
  void Refresh(const JobId& id);
  // With mutex_ held: whether to look at once at what the store has.
  bool WantsLook() const;
  void EnforceDeadlines();
  void FailUnmeetable();
  std::vector<std::shared_ptr<JobRun>> Runs() const;
  std::optional<Time> NextDeadline() const;

  std::shared_ptr<EventLog> LogOf(const Job& job);
  static Scheduler::Request RequestOf(const Job& job);
  static Scheduler::Request RequestOf(const NewJob& job);

  const JobManagerOptions options_;
  JobStore& store_;
  const CostModel cost_;
  const SolveFunction solve_;
  const Clock& clock_;
  WatchDispatcher dispatcher_;
  CheckpointWriter writer_;
  EventRelay relay_;

  mutable std::mutex mutex_;
  std::condition_variable work_;   // something may start, or the end
  std::condition_variable house_;  // something to do for the housekeeper
  std::condition_variable idle_;   // nothing runs
  Scheduler scheduler_;
  std::map<JobId, Active> active_;
  std::map<JobId, std::weak_ptr<EventLog>> logs_;
  // What was heard from the store: that these jobs changed, that there are others to claim, and anything at all.
  std::set<JobId> heard_of_;
  bool heard_of_work_ = false;
  bool heard_something_ = false;
  std::map<JobId, Audience> watched_elsewhere_;
  bool asks_others_ = false;  // somebody began to watch a job that does not run here
  std::atomic<bool> leases_released_ = false;
  bool draining_ = false;
  bool abandoning_ = false;  // the store is not waited for any more
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_JOB_MANAGER_H_
