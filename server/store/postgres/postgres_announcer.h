// SPDX-License-Identifier: Apache-2.0
// Notifies the other servers on one PostgreSQL of changes by this one (NOTIFY).

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

// A thread that sends notifications after the commit of a change. PostgreSQL commits notifying transactions one at a
// time, their flush included; a transaction that only notifies needs no flush. Every server receives every
// notification, so there are few: at most one statement every 20 ms, which announces claimable jobs once, and events
// only of jobs that some server follows.
// Notifications are lost if the server is killed before it sends them, if the database does not answer, and for servers
// that are just connecting. Then the others see a change when they poll, JobManagerOptions::poll (1 s) later; a
// cancellation when the lease is renewed (a quarter of it, 7.5 s).
//
// Safe from any thread.
class PostgresAnnouncer {
 public:
  // `database` must outlive it.
  explicit PostgresAnnouncer(PostgresDatabase& database);
  // Sends what is left, if the database works.
  ~PostgresAnnouncer();
  PostgresAnnouncer(const PostgresAnnouncer&) = delete;
  PostgresAnnouncer& operator=(const PostgresAnnouncer&) = delete;

  // `what` is kClaimable, kEvents or kCancelling, and is committed. Does not block.
  void Announce(JobChange::What what, const JobId& job);
  // Some server follows the job: its events are announced for the next 15 s at least. Those of the last seconds are
  // announced now, since that server may have read the job before they were stored.
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
  RecentJobs unannounced_{std::chrono::seconds(5)};
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_ANNOUNCER_H_
