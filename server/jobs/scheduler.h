// SPDX-License-Identifier: Apache-2.0
// Decides which jobs are admitted and which job runs next: limits, fairness between users, concurrency.

#ifndef DLCS_SERVER_JOBS_SCHEDULER_H_
#define DLCS_SERVER_JOBS_SCHEDULER_H_

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/store/clock.h"
#include "server/store/job.h"
#include "server/store/refusal.h"

namespace dlcs::jobs {

struct SchedulerLimits {
  int cores = 1;  // threads of all running jobs together
  std::int64_t max_running_memory_bytes = std::int64_t{4} << 30;
  int max_threads_per_job = 1 << 20;                          // a job that asks for more gets this many
  std::int64_t max_job_memory_bytes = std::int64_t{4} << 30;  // at most max_running_memory_bytes
  double max_job_core_seconds = 24 * 3600;
  int max_queued_jobs = 1000;
  int max_queued_jobs_per_user = 200;
  double max_queued_core_seconds = 24 * 3600;

  // While a user is idle, its share accumulates up to this limit or the size of the largest running job, so that its
  // next job need not wait for the turns of busy users.
  double max_saved_core_seconds = 5;
  // Jobs above large_core_seconds leave this many cores free, so that small jobs stay fast beside them.
  double large_core_seconds = 30;
  int cores_kept_for_small = 0;
  // Running jobs are not interrupted. But a job of at most small_core_seconds need not wait until one ends: this many
  // threads of such jobs may run in addition to the cores, if their user has accumulated what they cost and has nothing
  // else running. They then share the processors with the other jobs.
  double small_core_seconds = 1;
  int burst_cores = 0;
  // A job that is next but needs more memory or cores than are free is passed over for this long; after that nothing
  // else starts until it fits.
  Duration max_skip_time = std::chrono::seconds(30);
};

// A pure data structure without threads; its owner guards it with a mutex. Costs: O(users + jobs passed over) for a
// decision, O(jobs of the user) for an admission.
//
// Between users: deficit round robin by core-seconds [Shreedhar & Varghese 1996], with infinitely small rounds: all
// waiting users receive the same credit until the first of them can pay for its next job; if several can, the one with
// the most credit left goes first. A job is charged its predicted cost when it starts and the difference to the actual
// cost when it ends, so there is no gain from low predictions. Within a user: higher priority first, then first come,
// first served. Priorities have no effect between users, since every user would ask for the highest.
//
// Source: M. Shreedhar, G. Varghese. Efficient fair queuing using deficit round-robin. IEEE/ACM Transactions on
// Networking 4(3), 1996, 375-385.
class Scheduler {
 public:
  struct Request {
    JobId id;  // unique in the scheduler
    std::string owner;
    int priority = 0;
    Demand demand;
    std::optional<Time> deadline;
    // It starts with the cores that are free, at least one and at most demand.threads, instead of waiting for all.
    bool takes_free_cores = false;
    // It counts as queued, but this server never starts it; another one can.
    bool is_for_others = false;
  };

  // `clock` must outlive it.
  Scheduler(const SchedulerLimits& limits, const Clock& clock) : limits_(limits), clock_(clock) {}

  // The refusal if the queue has no place for another job of `owner`. Cheap, so it can be called before the request is
  // read.
  std::optional<Refusal> RefuseIfFull(const std::string& owner) const;
  // The refusal with the limit that the job exceeds now; absent if it would be admitted.
  std::optional<Refusal> Refuse(const Request& request) const;
  // Reserves a place in the queue for a job that is not stored yet, or returns the refusal. Confirm() takes the place,
  // Remove() gives it back.
  std::optional<Refusal> Reserve(const Request& request);
  void Confirm(const JobId& id);
  // Reserve() and Confirm().
  std::optional<Refusal> Enqueue(const Request& request);
  // Queues a job that was admitted earlier, without checking limits.
  void Restore(const Request& request);
  // Removes a job from the queue. False if it is not there.
  bool Remove(const JobId& id);

  struct Start {
    JobId id;
    int threads = 1;
  };
  // The job to start now; absent if none is queued or none fits beside the running ones.
  std::optional<Start> StartNext();
  // Alternatives to `started`, which StartNext() returned and another server may have claimed meanwhile: the next jobs
  // in turn that fit into its cores and memory, at most `most` and half of the queue. None for ensembles, whose shards
  // several servers solve, and none on burst cores, which are few. Nothing else starts them until Settle(). O(users +
  // most + jobs passed over).
  std::vector<JobId> SetAside(const JobId& started, int most);
  // Queues the alternatives as before.
  void PutBack(const JobId& started);
  // Ends the claim of `started` and its alternatives. `claimed` is the first of them that this server could claim.
  // Those before it (all if it is absent) belong to other servers and leave the queue; those after it are queued as
  // before. Returns the job that runs now, absent if there is none. If it is an alternative, `started` has ended; if it
  // is absent, `started` keeps its cores until Finished().
  std::optional<Start> Settle(const JobId& started, const std::optional<Request>& claimed);
  // Frees the cores of a job that no longer needs them, after `core_seconds`. It keeps its memory.
  void GiveBackCores(const JobId& id, double core_seconds);
  // The job has ended or was released; frees its memory, and its cores if it still has them.
  void Finished(const JobId& id, double core_seconds);

  // Removes and returns the queued jobs that would miss their deadline even if they started now, and the ensembles
  // whose deadline has passed.
  std::vector<JobId> TakeUnmeetable();

  std::vector<JobId> QueuedIds() const;
  // Including reserved places.
  int queued() const { return static_cast<int>(queued_.size() + reserved_.size()); }
  int running() const { return static_cast<int>(running_.size()); }
  bool has_free_cores() const { return busy_cores_ < limits_.cores; }
  double queued_core_seconds() const { return queued_core_seconds_; }
  bool Knows(const JobId& id) const { return queued_.contains(id) || running_.contains(id) || reserved_.contains(id); }

 private:
  struct QueueKey {
    int priority = 0;
    std::int64_t arrival = 0;
    bool operator<(const QueueKey& other) const {
      return priority != other.priority ? priority > other.priority : arrival < other.arrival;
    }
  };
  struct Queued {
    Request request;
    std::optional<Duration> passed_over_since;
    bool is_aside = false;  // nothing starts it
  };
  struct Owner {
    std::map<QueueKey, Queued> queue;
    double deficit = 0;  // its credit in core-seconds; negative after predictions that were too low
    double queued_core_seconds = 0;
    double idle_since = 0;  // given_ when its queue became empty
    int running = 0;        // jobs that have cores
  };
  struct Running {
    Request request;
    Duration since;
    bool on_burst_cores = false;
    bool has_cores = true;
    std::vector<JobId> aside = {};
  };
  struct Place {
    std::string owner;
    QueueKey key;
  };
  struct Choice {
    std::map<std::string, Owner>::iterator owner;
    std::map<QueueKey, Queued>::iterator job;
    double missing = 0;  // core-seconds that the owner's deficit lacks to pay for it
  };

  std::optional<Refusal> RefuseForDeadline(const Request& request) const;
  void Add(Request request);
  static Time LatestStart(const Request& request);
  Request Take(const JobId& id);
  bool IsLarge(const Demand& demand) const { return demand.core_seconds > limits_.large_core_seconds; }
  bool Fits(const Request& request) const;
  // Whether it fits into the cores and memory of `place`.
  bool FitsInto(const Running& place, const Request& request) const;
  // The number of cores that a job with this `demand` may get now.
  int FreeCores(const Demand& demand) const;
  bool FitsMemory(const Demand& demand) const;
  // The credit that a user would have if it queued a job now.
  double Savings(const Owner& owner) const;
  // Whether a job with this `demand`, the first of `owner`, may run in addition to the cores, with `savings` to pay for
  // it.
  bool MayBorrow(const Demand& demand, const Owner& owner, double savings) const;
  // The small job to start in addition to the cores.
  std::optional<Choice> ChooseSmall();
  // The next job among the first jobs of all users, or among those that fit.
  std::optional<Choice> Choose(bool only_fitting);
  Start Begin(const Choice& choice, bool on_burst_cores = false);
  double RunSeconds(const Demand& demand) const { return demand.core_seconds / demand.threads; }
  double RunningCoreSeconds() const;
  // The estimated time until a new job of this user starts, from the queued and running jobs.
  double WaitSeconds(const Request& request) const;

  const SchedulerLimits limits_;
  const Clock& clock_;
  std::int64_t arrivals_ = 0;
  std::map<std::string, Owner> owners_;
  std::string turn_;  // the owner that was served last
  double given_ = 0;  // total credit of a user who has always been waiting
  std::map<JobId, Request> reserved_;
  std::map<JobId, Place> queued_;
  std::set<std::pair<Time, JobId>> latest_starts_;  // of queued jobs with a deadline
  double queued_core_seconds_ = 0;                  // including those of reserved places
  std::map<JobId, Running> running_;
  int busy_cores_ = 0;  // without the additional threads of small jobs
  int busy_cores_of_large_ = 0;
  int burst_cores_in_use_ = 0;
  std::int64_t busy_memory_bytes_ = 0;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_SCHEDULER_H_
