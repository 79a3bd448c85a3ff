// SPDX-License-Identifier: Apache-2.0
// The rows of a job in a database: the interface that the transitions of jobs (job_transitions.h) need.

#ifndef DLCS_SERVER_STORE_JOB_TABLE_H_
#define DLCS_SERVER_STORE_JOB_TABLE_H_

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/store/clock.h"
#include "server/store/job_store.h"

namespace dlcs::jobs {

struct JobRow {
  std::int64_t number = 0;  // of the row; rises with the time of creation
  Job job;
  std::string body_hash;
  std::int64_t fence = 0;
  std::string worker;
  Time lease_until;
  Time now;  // the store's time when the row was read
};

// A shard of an ensemble that has not ended.
struct ShardRow {
  std::int64_t number = 0;  // from 0
  std::string worker = {};
  Time lease_until = {};
  std::int64_t fence = 0;
  int attempts = 0;
};

// Used within one transaction, which is rolled back unless the transition succeeds. Failures throw the database's
// error.
class JobTable {
 public:
  virtual ~JobTable() = default;

  // Absent if there is no such row.
  virtual std::optional<JobRow> Find(const JobId& id) = 0;
  // The same, and locks the row until the transaction ends.
  virtual std::optional<JobRow> Lock(const JobId& id) = 0;
  // Locks the first of `candidates` that may be claimed, skipping rows that others have locked.
  virtual std::optional<JobRow> LockClaimable(std::span<const JobId> candidates) = 0;
  // Those that are ensembles, in this order. Not locked.
  virtual std::vector<JobId> EnsemblesAmong(std::span<const JobId> candidates) = 0;
  // Not locked.
  virtual std::optional<JobRow> FindRequest(const std::string& owner, const std::string& request_id) = 0;

  // Marks the owner's uploaded problem as used now, and keeps it from being deleted until the transaction ends. False
  // if there is none with this id.
  virtual bool UseProblem(const std::string& owner, const std::string& id) = 0;
  // Inserts a new job, its body and its shards, QUEUED and without events, and returns its locked row. Absent if its
  // request_id was used meanwhile.
  virtual std::optional<JobRow> Insert(const NewJob& job) = 0;
  // Writes the columns that may change. `job.last_event` may be derived from the events instead.
  virtual void Save(const JobRow& row) = 0;
  // Deletes the job with all its data.
  virtual void Delete(std::int64_t number) = 0;

  virtual std::string ReadBody(std::int64_t number) = 0;
  virtual std::optional<std::string> ReadResumeState(std::int64_t number) = 0;
  virtual void SaveResumeState(std::int64_t number, const std::string& state) = 0;
  virtual void DropResumeState(std::int64_t number) = 0;
  // False if an event with this number exists, which is not changed.
  virtual bool AddEvent(std::int64_t number, const Event& event) = 0;
  virtual bool AddChunk(std::int64_t number, const Chunk& chunk) = 0;

  // The shards of the job with this number, whose row must be locked. Absent if there is none, or none to claim.
  virtual std::optional<ShardRow> FindShard(std::int64_t number, std::int64_t shard) = 0;
  virtual std::optional<ShardRow> FindClaimableShard(std::int64_t number) = 0;
  virtual std::string ReadShardInput(std::int64_t number, std::int64_t shard) = 0;
  virtual void SaveShard(std::int64_t number, const ShardRow& shard) = 0;
  // Deletes one of them, or all.
  virtual void DropShards(std::int64_t number, std::optional<std::int64_t> shard) = 0;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_JOB_TABLE_H_
