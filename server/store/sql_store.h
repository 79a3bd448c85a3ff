// SPDX-License-Identifier: Apache-2.0
// The functions that are the same for all databases: each runs one transition (job_transitions.h) in one transaction.

#ifndef DLCS_SERVER_STORE_SQL_STORE_H_
#define DLCS_SERVER_STORE_SQL_STORE_H_

#include <optional>
#include <span>
#include <string>
#include <utility>

#include "server/store/job_table.h"
#include "server/store/job_transitions.h"
#include "server/store/store.h"

namespace dlcs::jobs {

// `Database` has Options, Connection, Write(), Read() and healthy() like SqliteDatabase; `Table` is a JobTable over its
// connections.
template <typename Database, typename Table>
class SqlStore : public Store {
 public:
  absl::StatusOr<Created> Create(const NewJob& job) final {
    return AnnounceIfOk(JobChange::What::kClaimable, job.id,
                        Write([&](Table& table) { return CreateJob(table, job); }));
  }
  absl::StatusOr<std::optional<Job>> FindRequest(const std::string& owner, const std::string& request_id,
                                                 const std::string& body_hash) final {
    return Read([&](Table& table) { return FindRequestedJob(table, owner, request_id, body_hash); });
  }
  absl::StatusOr<Job> Get(const std::optional<std::string>& owner, const JobId& id) final {
    return Read([&](Table& table) { return VisibleJob(table.Find(id), owner, id); });
  }
  absl::StatusOr<Job> RequestCancel(const std::optional<std::string>& owner, const JobId& id) final {
    absl::StatusOr<Job> job = Write([&](Table& table) { return RequestCancelOfJob(table, owner, id); });
    if (job.ok() && job->state == JobState::kCancelling) Announce(JobChange::What::kCancelling, id);
    return AnnounceIfOk(JobChange::What::kEvents, id, std::move(job));
  }
  absl::Status Delete(const std::optional<std::string>& owner, const JobId& id) final {
    return Write([&](Table& table) { return DeleteJob(table, owner, id); });
  }

  absl::StatusOr<std::optional<ClaimedJob>> Claim(const std::string& worker, Duration lease,
                                                  std::span<const JobId> candidates) final {
    absl::StatusOr<std::optional<ClaimedJob>> claimed =
        Write([&](Table& table) { return ClaimJob(table, worker, lease, candidates); });
    if (claimed.ok() && claimed->has_value()) Announce(JobChange::What::kEvents, (*claimed)->job.id);
    return claimed;
  }
  absl::StatusOr<bool> RenewLease(const Lease& lease, Duration duration) final {
    return Write([&](Table& table) { return RenewLeaseOfJob(table, lease, duration); });
  }
  absl::Status Append(const Lease& lease, const Progress& progress) final {
    absl::Status status = Write([&](Table& table) { return AppendToJob(table, lease, progress); });
    return progress.events.empty() ? status : AnnounceIfOk(JobChange::What::kEvents, lease.job, std::move(status));
  }
  absl::Status Finish(const Lease& lease, const Outcome& outcome) final {
    return AnnounceIfOk(JobChange::What::kEvents, lease.job,
                        Write([&](Table& table) { return FinishJob(table, lease, outcome); }));
  }
  absl::Status FinishShard(const Lease& lease, const ShardResult& result) final {
    return AnnounceIfOk(JobChange::What::kEvents, lease.job,
                        Write([&](Table& table) { return FinishShardOfJob(table, lease, result); }));
  }
  absl::Status Release(const Lease& lease, std::int64_t through, bool in_vain) final {
    absl::Status status = Write([&](Table& table) { return ReleaseJob(table, lease, through, in_vain); });
    if (status.ok()) Announce(JobChange::What::kClaimable, lease.job);
    return AnnounceIfOk(JobChange::What::kEvents, lease.job, std::move(status));
  }

  bool Healthy() const final { return database_.healthy(); }

 protected:
  using Connection = typename Database::Connection;

  explicit SqlStore(typename Database::Options options) : database_(std::move(options)) {}

  // The rows of jobs in the transaction that `connection` is in.
  virtual Table TableIn(Connection& connection) const = 0;

  // Soon notifies the other servers of a committed change of the job: kClaimable, kEvents or kCancelling. Does not
  // block.
  virtual void Announce(JobChange::What what, const JobId& id) {
    static_cast<void>(what);
    static_cast<void>(id);
  }

  Database database_;

 private:
  template <typename Result>
  Result AnnounceIfOk(JobChange::What what, const JobId& id, Result result) {
    if (result.ok()) Announce(what, id);
    return result;
  }

  // The result of `rule(Table&)` in a transaction of the database, timed under the name of the calling function.
  template <typename Rule>
  auto Write(const Rule& rule, const char* operation = __builtin_FUNCTION()) {
    return database_.Write(OnTable(rule), operation);
  }
  // The same for a rule that only reads.
  template <typename Rule>
  auto Read(const Rule& rule, const char* operation = __builtin_FUNCTION()) {
    return database_.Read(OnTable(rule), operation);
  }

  // `rule`, which must outlive it, as a function of a connection.
  template <typename Rule>
  auto OnTable(const Rule& rule) const {
    return [this, &rule](Connection& connection) {
      Table table = TableIn(connection);
      return rule(table);
    };
  }
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_SQL_STORE_H_
