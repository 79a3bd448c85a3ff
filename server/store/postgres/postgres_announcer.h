// SPDX-License-Identifier: Apache-2.0
// Tells the other servers on one PostgreSQL what this one has changed (NOTIFY).

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_ANNOUNCER_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_ANNOUNCER_H_

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "server/store/job_store.h"
#include "server/store/postgres/postgres_database.h"

namespace dlcs::jobs {

// A thread that notifies after the commit of what it tells. PostgreSQL lets only one transaction at a time commit that
// has notified, its flush included; one that has done nothing else needs no flush. And every server hears every
// notification, so there are few: at most one statement every 20 ms, in which "there are jobs to claim" is said once,
// and events are told of jobs only that some server follows.
//
// Lost are: what a server had not told when it was killed, or could not tell because the database did not answer; and
// what others do not hear while they connect. Then others see a change when they poll, JobManagerOptions::poll (1 s)
// later; a cancellation when the lease is renewed (a quarter of it, 7.5 s).
//
// Safe from any thread.
class PostgresAnnouncer {
 public:
  // `database` must outlive it.
  explicit PostgresAnnouncer(PostgresDatabase& database);
  // What is left is told, where the database works.
  ~PostgresAnnouncer();
  PostgresAnnouncer(const PostgresAnnouncer&) = delete;
  PostgresAnnouncer& operator=(const PostgresAnnouncer&) = delete;

  // `what` is kClaimable, kEvents or kCancelling, and is committed. Does not block.
  void Announce(JobChange::What what, const JobId& job);
  // Some server follows the job: its events are told for the next 15 s at least. Those of the last seconds are told
  // now, since it may have read the job before they were stored.
  void OnFollowed(const JobId& job);

 private:
  // Jobs of the last `period` at least, and of twice as long at most; of fewer where there are very many.
  class RecentJobs {
   public:
    explicit RecentJobs(std::chrono::steady_clock::duration period) : period_(period) {}
    void Add(const JobId& job);
    bool Contains(const JobId& job);

   private:
    void Forget();

    const std::chrono::steady_clock::duration period_;
    std::set<JobId> newer_, older_;
    std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();  // of `newer_`
  };

  void Work();
  void Notify(const std::set<std::string>& payloads);

  PostgresDatabase& database_;
  std::mutex mutex_;
  std::condition_variable changed_;
  JobId claimable_;  // the last one
  std::set<std::string> payloads_;
  RecentJobs followed_{std::chrono::seconds(15)};
  RecentJobs untold_{std::chrono::seconds(5)};
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_ANNOUNCER_H_
