// SPDX-License-Identifier: Apache-2.0
// Which job next, and which not at all: admission, fairness between users, and what runs at the same time.

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
  int max_threads_per_job = 1 << 20;                          // a job that asks for more gets these
  std::int64_t max_job_memory_bytes = std::int64_t{4} << 30;  // at most max_running_memory_bytes
  double max_job_core_seconds = 24 * 3600;
  int max_queued_jobs = 1000;
  int max_queued_jobs_per_user = 200;
  double max_queued_core_seconds = 24 * 3600;

  // A user who was idle has saved as much as its share would have been, up to this, or to the largest job that runs: it
  // need not wait for the turns of those who always want more.
  double max_saved_core_seconds = 5;
  // Jobs above large_core_seconds leave so many cores to the others, so that small jobs stay fast beside them.
  double large_core_seconds = 30;
  int cores_kept_for_small = 0;
  // Jobs that run are not interrupted for others; but a job of at most small_core_seconds need not wait for the end of
  // one: so many threads of such jobs run beside full cores, where their user has saved what they cost and has nothing
  // else running. The machine then shares its time between them and the others.
  double small_core_seconds = 1;
  int burst_cores = 0;
  // A job whose turn it is but that needs more memory or cores than are free is passed over for so long; then nothing
  // else starts until it fits.
  Duration max_skip_time = std::chrono::seconds(30);
};

// A pure data structure: it starts nothing, and its owner guards it with a mutex. Costs: O(users + jobs passed over)
// for a decision, O(jobs of the user) for an admission.
//
// Between users: deficit round robin by core-seconds [Shreedhar & Varghese 1996], with rounds as small as one likes:
// a job starts when its user's deficit pays for it, all users who wait get the same until the first of them can pay,
// and the one who can spare most goes first. Jobs are paid for as predicted when they start, and corrected when they
// end: predicting too little gains nothing. Within a user: higher priority first, then first come, first served. A
// priority does not count between users, since everybody would ask for the highest.
//
// Source: M. Shreedhar, G. Varghese. Efficient fair queuing using deficit round-robin. IEEE/ACM Transactions on
// Networking 4(3), 1996, 375-385.
class Scheduler {
 public:
  struct Request {
    JobId id;  // of no other job in here
    std::string owner;
    int priority = 0;
    Demand demand;
    std::optional<Time> deadline;
  };

  // `clock` must outlive it.
  Scheduler(const SchedulerLimits& limits, const Clock& clock) : limits_(limits), clock_(clock) {}

  // Whether there is no place in the queue for a further job of `owner`, whatever it needs: cheap, to be asked before
  // anything is found out about it.
  std::optional<Refusal> RefuseForPlaces(const std::string& owner) const;
  // Which limit speaks against the job now; nothing where it would be taken.
  std::optional<Refusal> Refuse(const Request& request) const;
  // Keeps a place in the queue for a job that is still to be stored, or says which limit speaks against it. The place
  // is taken by Confirm() or given back by Remove().
  std::optional<Refusal> Reserve(const Request& request);
  void Confirm(const JobId& id);
  // Both at once.
  std::optional<Refusal> Enqueue(const Request& request);
  // Queues a job that was admitted before, whatever the limits say now.
  void Restore(const Request& request);
  // Takes a job out of the queue. False when it is not there.
  bool Remove(const JobId& id);

  struct Start {
    JobId id;
    int threads = 1;
  };
  // The job to start now; nothing when none is queued or none fits beside those that run.
  std::optional<Start> StartNext();
  // The job needs no core any more, after so many core-seconds: others may have them. It keeps its memory.
  void GiveBackCores(const JobId& id, double core_seconds);
  // The job has ended, or was given back; with its cores where it still has them.
  void Finished(const JobId& id, double core_seconds);

  // Takes out the queued jobs that would end after their deadline if they started now.
  std::vector<JobId> TakeHopeless();

  std::vector<JobId> QueuedIds() const;
  // With the places kept.
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
  };
  struct Owner {
    std::map<QueueKey, Queued> queue;
    double deficit = 0;  // core-seconds it may use; below 0 after underpredictions
    double queued_core_seconds = 0;
    double idle_since = 0;  // given_ when its queue became empty
    int running = 0;        // jobs that have cores
  };
  struct Running {
    Request request;
    Duration since;
    bool on_lent_cores = false;
    bool has_cores = true;
  };
  struct Place {
    std::string owner;
    QueueKey key;
  };
  struct Choice {
    std::map<std::string, Owner>::iterator owner;
    std::map<QueueKey, Queued>::iterator job;
    double missing = 0;  // until the owner's deficit pays for it
  };

  std::optional<Refusal> RefuseForDeadline(const Request& request) const;
  void Add(Request request);
  static Time LatestStart(const Request& request);
  Request Take(const JobId& id);
  bool IsLarge(const Demand& demand) const { return demand.core_seconds > limits_.large_core_seconds; }
  bool Fits(const Demand& demand) const;
  bool FitsMemory(const Demand& demand) const;
  // What a user has to spend, were it to queue a job now.
  double Savings(const Owner& owner) const;
  // Whether the first job of `owner` may run on cores that are lent, were it `demand` with `savings` to pay for it.
  bool MayBorrow(const Demand& demand, const Owner& owner, double savings) const;
  // The job to start on cores that are lent.
  std::optional<Choice> ChooseSmall();
  // The turn among the first jobs of all users, or among the first that fit.
  std::optional<Choice> Choose(bool only_fitting);
  Start Begin(const Choice& choice, bool on_lent_cores = false);
  double RunSeconds(const Demand& demand) const { return demand.core_seconds / demand.threads; }
  double RunningCoreSeconds() const;
  // Until a new job of this user starts, by what is queued and runs now.
  double WaitSeconds(const Request& request) const;

  const SchedulerLimits limits_;
  const Clock& clock_;
  std::int64_t arrivals_ = 0;
  std::map<std::string, Owner> owners_;
  std::string turn_;  // the owner that was served last
  double given_ = 0;  // to each user who waited all the time
  std::map<JobId, Request> reserved_;
  std::map<JobId, Place> queued_;
  std::set<std::pair<Time, JobId>> latest_starts_;  // of queued jobs with a deadline
  double queued_core_seconds_ = 0;                  // with those of places kept
  std::map<JobId, Running> running_;
  int busy_cores_ = 0;  // without those lent
  int busy_cores_of_large_ = 0;
  int lent_cores_ = 0;
  std::int64_t busy_memory_bytes_ = 0;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_SCHEDULER_H_
