// SPDX-License-Identifier: Apache-2.0
// The interface of the job store, which keeps jobs over restarts and may be shared by several servers.

#ifndef DLCS_SERVER_STORE_JOB_STORE_H_
#define DLCS_SERVER_STORE_JOB_STORE_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/clock.h"
#include "server/store/event.h"
#include "server/store/event_detail.h"
#include "server/store/job.h"

namespace dlcs::jobs {

// The right to write to a job. Every claim gets a higher `fence`, and every write under a lease names it. If a worker
// was taken for dead and another one has claimed the job, the writes of the first are refused (ABORTED).
//
// The lease on a job that is an ensemble is one on a shard of it. Several workers may have one each.
struct Lease {
  JobId job;
  std::string worker;
  std::int64_t fence = 0;
  std::optional<std::int64_t> shard = {};  // its number, from 0
};

struct ClaimedJob {
  Job job;  // kRunning, or kCancelling if it was asked to stop
  Lease lease;
  std::string body;
  // The state after the last accepted window; absent if there is none. job.chunks parts of the trajectory belong to it.
  std::optional<std::string> resume_state;
  std::optional<std::string> shard_input = {};  // of the shard in the lease; job.attempts are then those at this shard
};

// A part of the trajectory, [begin, end] in the time of the problem. Parts are numbered from 0.
struct Chunk {
  std::int64_t number = 0;
  double begin = 0;
  double end = 0;
  std::string data;
};

// Data that a running job appends in one transaction. Appending the same again has no effect, so that a write whose
// outcome is unknown can be repeated.
struct Progress {
  std::vector<Chunk> chunks;         // continue the stored ones
  std::optional<std::string> state;  // the state to resume from after these chunks
  std::vector<Event> events;         // durable events
  std::int64_t reserve_through = 0;  // event numbers up to this may be used; the mark never decreases
  double progress = 0;
};

struct Outcome {
  JobState state = JobState::kFailed;  // a final one
  absl::Status error;
  std::vector<Event> events;  // the last is the summary
  std::string tally = {};     // as Job::tally
};

// The result of a shard of an ensemble.
struct ShardResult {
  // The counts over the members of all stored shards.
  struct Count {
    std::string tally;  // the job's from now on
    std::string event;  // payload of kWindowAccepted
  };

  double begin = 0;  // of Chunk
  double end = 0;
  std::string data;
  // The new count, from the job before this shard. Has no effects, since it is called again where a transaction is
  // repeated.
  std::function<Count(const Job& before)> count;
};

struct JobFilter {
  std::optional<std::string> owner;  // absent: the jobs of all users
  std::vector<JobState> states;      // empty: all
};

struct JobPage {
  std::vector<Job> jobs;        // newest first
  std::string next_page_token;  // empty at the end
};

struct Expiry {
  Duration max_age = std::chrono::hours(24 * 7);                 // of finished jobs
  std::int64_t max_finished_bytes = std::int64_t{10} << 30;      // the oldest go first
  Duration max_unused_problem_age = std::chrono::hours(24 * 7);  // since their last use (problem_store.h)
};

// The jobs that could be claimed at one moment.
struct QueueDepth {
  std::int64_t jobs = 0;
  double core_seconds = 0;  // predicted, of all of them
  Duration oldest_age{};    // since the first of them was created
};

// A notification about a job from the store or from another server.
struct JobChange {
  enum class What {
    // From the store itself:
    kClaimable,   // the job was created or released
    kEvents,      // it has further durable events; of jobs that some server follows
    kCancelling,  // it was asked to stop while it was running
    kUnknown,     // anything may have changed in any job
    // From servers (JobStore::Publish):
    kFollowed,  // some server waits for its durable events; for 15 s
    // The same, and it is watched on another server than the one that runs it, which wants `detail`.
    kWatched,
    // `event`, which is not in the store; `durable_before` is the number of the last durable event before it, or above.
    kTransient,
  };
  What what = What::kUnknown;
  JobId job = {};  // empty for kUnknown
  EventDetail detail = {};
  Event event = {};
  std::int64_t durable_before = 0;
};

// Common to all functions:
//
// OK means durable: it survives kill -9 and a power cut. Functions block on the disk or the network; never call them
// from a reaction. They are safe from any thread and from several servers at once. Time is the store's own, so that
// leases do not depend on the clocks of workers.
//
// `owner`: absent for callers who may see the jobs of all users. A job of another user is NOT_FOUND.
//
// Errors, besides those named: UNAVAILABLE (disk full, locked, gone; try again), DATA_LOSS (the database is damaged),
// with a text for the operator. After either, Healthy() is false until something succeeds.
class JobStore {
 public:
  struct Created {
    Job job;
    bool existed = false;  // an earlier request with the same request_id created it
  };

  virtual ~JobStore() = default;

  // The job is QUEUED, an ensemble RUNNING; event 1 says so. Errors: ALREADY_EXISTS when request_id belongs to a job
  // with another body_hash; NOT_FOUND when the owner has no such problem.
  virtual absl::StatusOr<Created> Create(const NewJob& job) = 0;
  // The job created with `request_id`, if there is one. Errors: ALREADY_EXISTS as above.
  virtual absl::StatusOr<std::optional<Job>> FindRequest(const std::string& owner, const std::string& request_id,
                                                         const std::string& body_hash) = 0;

  virtual absl::StatusOr<Job> Get(const std::optional<std::string>& owner, const JobId& id) = 0;
  // `page_size` from 1. Errors: INVALID_ARGUMENT for an invalid token.
  virtual absl::StatusOr<JobPage> List(const JobFilter& filter, int page_size, const std::string& page_token) = 0;

  // Requests a stop: QUEUED becomes CANCELLED with its summary, and so does an ensemble, whose leases are lost; a solve
  // that is RUNNING becomes CANCELLING, which the next RenewLease() reports to the holder of the lease. Other states do
  // not change.
  virtual absl::StatusOr<Job> RequestCancel(const std::optional<std::string>& owner, const JobId& id) = 0;
  // Deletes the job with all its data. Errors: FAILED_PRECONDITION unless its state is final.
  virtual absl::Status Delete(const std::optional<std::string>& owner, const JobId& id) = 0;

  // Jobs that a worker may claim now: QUEUED, or with an expired lease, or with a shard that nobody holds; the oldest
  // `limit` of them.
  virtual absl::StatusOr<std::vector<Job>> ListClaimable(int limit) = 0;
  // All of them together; each shard counts as a job.
  virtual absl::StatusOr<QueueDepth> MeasureQueue() = 0;
  // Claims the first of `candidates` that is claimable and that no other worker is claiming at this moment; absent if
  // there is none. (PostgreSQL: FOR UPDATE SKIP LOCKED.) Writes the event RUNNING (CANCELLING) with the number
  // job.sequence. Of an ensemble it claims the first shard that nobody holds, and writes no event.
  virtual absl::StatusOr<std::optional<ClaimedJob>> Claim(const std::string& worker, Duration lease,
                                                          std::span<const JobId> candidates) = 0;
  // Ends the leases that an earlier process of `worker` left. Returns how many.
  virtual absl::StatusOr<int> ReleaseLeases(const std::string& worker) = 0;

  // True if a stop of the job was requested. Errors of all functions that write under a lease: ABORTED if it was lost.
  virtual absl::StatusOr<bool> RenewLease(const Lease& lease, Duration duration) = 0;
  virtual absl::Status Append(const Lease& lease, const Progress& progress) = 0;
  // With the lease on a shard, ends the whole ensemble; its events are the store's own.
  virtual absl::Status Finish(const Lease& lease, const Outcome& outcome) = 0;
  // Stores the result of a shard as the next chunk, and an event, and ends its lease, in one transaction. With the last
  // shard the ensemble has SUCCEEDED. Errors: ABORTED also where it is repeated: the result is in the store then.
  virtual absl::Status FinishShard(const Lease& lease, const ShardResult& result) = 0;
  // Releases the job, or the shard, so that any worker can resume it: QUEUED, or still CANCELLING. `through` is the
  // last event number used; a shard uses none. `in_vain`: the attempt failed, and counts as one without progress.
  virtual absl::Status Release(const Lease& lease, std::int64_t through, bool in_vain) = 0;

  // The durable events after `after`, in order, at most `limit`.
  virtual absl::StatusOr<std::vector<Event>> ReadEvents(const JobId& id, std::int64_t after, int limit) = 0;
  // Parts of the trajectory from number `from`: at least one, and more as long as all together fit into `max_bytes`.
  virtual absl::StatusOr<std::vector<Chunk>> ReadChunks(const JobId& id, std::int64_t from, std::int64_t max_bytes) = 0;

  // Deletes finished jobs that are too old or too many, and problems that nobody has used for long. Returns how many; a
  // call deletes at most a few hundred.
  virtual absl::StatusOr<int> Expire(const Expiry& expiry) = 0;

  // From now on calls `on_change` for changes by any server, soon after they were made, from a thread that should not
  // be blocked. An empty function ends that; when Subscribe() returns no call is running. Notifications may be lost, so
  // callers must poll too. Stores without notifications never call it.
  virtual void Subscribe(std::function<void(const JobChange& change)> on_change) { static_cast<void>(on_change); }

  // Sends `change` (kFollowed, kWatched or kTransient) to the listeners of all servers. It may be lost, and is not
  // stored. Blocks like the other functions.
  virtual void Publish(const JobChange& change) { static_cast<void>(change); }

  // Whether the last access to the database succeeded.
  virtual bool Healthy() const = 0;
  // Tests the store by a durable write.
  virtual absl::Status Probe() = 0;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_JOB_STORE_H_
