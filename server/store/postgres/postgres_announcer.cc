// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_announcer.h"

#include <utility>

#include "absl/strings/str_join.h"
#include "server/store/postgres/postgres_schema.h"

namespace dlcs::jobs {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenStatements{20};
// The largest size of each set; they would grow while the database does not respond.
constexpr std::size_t kMostJobs = 10'000;

std::string PayloadOf(char letter, const JobId& job) { return letter + job; }

}  // namespace

void PostgresAnnouncer::RecentJobs::Add(const JobId& job) {
  Forget();
  newer_.insert(job);
}

bool PostgresAnnouncer::RecentJobs::Contains(const JobId& job) {
  Forget();
  return newer_.contains(job) || older_.contains(job);
}

void PostgresAnnouncer::RecentJobs::Forget() {
  const steady_clock::time_point now = steady_clock::now();
  if (now - since_ < period_ && newer_.size() < kMostJobs) return;
  if (now - since_ >= 2 * period_) newer_.clear();
  older_ = std::exchange(newer_, {});
  since_ = now;
}

PostgresAnnouncer::PostgresAnnouncer(PostgresDatabase& database) : database_(database), thread_([this] { Work(); }) {}

PostgresAnnouncer::~PostgresAnnouncer() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void PostgresAnnouncer::Announce(JobChange::What what, const JobId& job) {
  {
    const std::lock_guard lock(mutex_);
    if (what == JobChange::What::kClaimable) {
      claimable_ = job;
    } else if (what == JobChange::What::kEvents && !followed_.Contains(job)) {
      unannounced_.Add(job);
      return;
    } else if (payloads_.size() < kMostJobs) {
      payloads_.insert(PayloadOf(what == JobChange::What::kCancelling ? kPostgresCancelling : kPostgresEvents, job));
    }
  }
  changed_.notify_one();
}

void PostgresAnnouncer::OnFollowed(const JobId& job) {
  {
    const std::lock_guard lock(mutex_);
    followed_.Add(job);
    if (!unannounced_.Contains(job) || payloads_.size() >= kMostJobs) return;
    payloads_.insert(PayloadOf(kPostgresEvents, job));
  }
  changed_.notify_one();
}

void PostgresAnnouncer::Work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !claimable_.empty() || !payloads_.empty(); });
    std::set<std::string> payloads = std::exchange(payloads_, {});
    if (!claimable_.empty()) payloads.insert(PayloadOf(kPostgresQueued, std::exchange(claimable_, {})));
    const bool is_last = ending_;
    lock.unlock();
    if (!payloads.empty() && (!is_last || database_.healthy())) Notify(payloads);
    lock.lock();
    if (is_last) return;
    changed_.wait_for(lock, kBetweenStatements, [this] { return ending_; });
  }
}

void PostgresAnnouncer::Notify(const std::set<std::string>& payloads) {
  const absl::Status notified = database_.Read(
      [&](PostgresConnection& connection) {
        connection.Run("SELECT pg_notify($1, payload) FROM unnest($2::text[]) AS payload",
                       std::string(kPostgresChannel), "{" + absl::StrJoin(payloads, ",") + "}");
        return absl::OkStatus();
      },
      "Announce");
  notified.IgnoreError();  // others poll
}

}  // namespace dlcs::jobs
