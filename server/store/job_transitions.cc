// SPDX-License-Identifier: Apache-2.0
#include "server/store/job_transitions.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <memory>
#include <utility>

#include "fmt/format.h"
#include "server/store/problem_store.h"

namespace dlcs::jobs {
namespace {

absl::Status NoSuchJob(const JobId& id) {
  // The requested name may be any text: only valid names are repeated in the message.
  return absl::NotFoundError(IsJobId(id) ? fmt::format("There is no job {}.", id) : "There is no job of that name.");
}

bool IsRunning(JobState state) { return state == JobState::kRunning || state == JobState::kCancelling; }

// The row of the job with this lease. The lease may have expired if no other worker has claimed the job.
absl::StatusOr<JobRow> Held(JobTable& table, const Lease& lease) {
  std::optional<JobRow> row = table.Lock(lease.job);
  if (!row.has_value() || row->fence != lease.fence || row->worker != lease.worker) {
    return absl::AbortedError("The lease on the job was lost: another server has it now.");
  }
  return *std::move(row);
}

absl::Status CheckRunning(const JobRow& row) {
  if (IsRunning(row.job.state)) return absl::OkStatus();
  return absl::AbortedError("The job has ended or was released.");
}

absl::StatusOr<JobRow> HeldAndRunning(JobTable& table, const Lease& lease) {
  absl::StatusOr<JobRow> row = Held(table, lease);
  if (!row.ok()) return row;
  if (absl::Status status = CheckRunning(*row); !status.ok()) return status;
  return row;
}

// Adds `event` unless it exists; raises the job's mark to its number.
void AddEvent(JobTable& table, JobRow& row, const Event& event) {
  if (!table.AddEvent(row.number, event)) return;
  row.job.sequence = std::max(row.job.sequence, event.sequence);
  row.job.last_event = std::max(row.job.last_event, event.sequence);
  row.job.stored_bytes += static_cast<std::int64_t>(event.payload->size());
}

// The job enters `state`, and an event with the next number reports it.
void EnterState(JobTable& table, JobRow& row, JobState state) {
  row.job.state = state;
  AddEvent(table, row,
           {.sequence = row.job.sequence + 1,
            .time = row.now,
            .kind = EventKind::kState,
            .payload = std::make_shared<const std::string>(JobStateName(state))});
}

void AddSummary(JobTable& table, JobRow& row) {
  AddEvent(table, row,
           {.sequence = row.job.sequence + 1,
            .time = row.now,
            .kind = EventKind::kSummary,
            .payload = std::make_shared<const std::string>()});
}

bool IsEnsemble(const Job& job) { return job.shards > 0; }

// The row of the ensemble, and the shard, with this lease, which may have expired as in Held().
struct HeldShard {
  JobRow row;
  ShardRow shard;
};
absl::StatusOr<HeldShard> HeldShardOf(JobTable& table, const Lease& lease) {
  std::optional<JobRow> row = table.Lock(lease.job);
  std::optional<ShardRow> shard;
  if (row.has_value()) shard = table.FindShard(row->number, *lease.shard);
  if (!shard.has_value() || shard->fence != lease.fence || shard->worker != lease.worker) {
    return absl::AbortedError(
        "The lease on the shard was lost: it is stored, another server has it, or the job ended.");
  }
  return HeldShard{*std::move(row), *std::move(shard)};
}

// The end of an ensemble. Leases on its shards are lost with them.
void EndEnsemble(JobTable& table, JobRow& row, JobState state, const absl::Status& error) {
  EnterState(table, row, state);
  AddSummary(table, row);
  row.job.finished = row.now;
  row.job.error = error;
  row.lease_until = {};
  table.DropShards(row.number, std::nullopt);
  table.Save(row);
}

// Claims a shard of the ensemble in `row`, which is locked; absent if there is none.
std::optional<ClaimedJob> ClaimShard(JobTable& table, JobRow row, const std::string& worker, Duration lease) {
  if (row.job.state == JobState::kCancelling) {  // by a server that knew no ensembles
    EndEnsemble(table, row, JobState::kCancelled, absl::OkStatus());
    return std::nullopt;
  }
  std::optional<ShardRow> shard = table.FindClaimableShard(row.number);
  if (!shard.has_value()) return std::nullopt;
  shard->worker = worker;
  shard->lease_until = row.now + lease;
  shard->fence = ++row.fence;
  ++shard->attempts;
  table.SaveShard(row.number, *shard);
  if (!row.job.started.has_value()) row.job.started = row.now;
  table.Save(row);
  ClaimedJob claimed{.job = row.job,
                     .lease = {.job = row.job.id, .worker = worker, .fence = shard->fence, .shard = shard->number},
                     .body = table.ReadBody(row.number),
                     .resume_state = std::nullopt,
                     .shard_input = table.ReadShardInput(row.number, shard->number)};
  claimed.job.attempts = shard->attempts;
  return claimed;
}

void AddChunk(JobTable& table, JobRow& row, const Chunk& chunk) {
  if (!table.AddChunk(row.number, chunk)) return;
  row.job.chunks = chunk.number + 1;
  row.job.attempts = 1;  // it made progress
  row.job.stored_bytes += static_cast<std::int64_t>(chunk.data.size());
}

}  // namespace

absl::StatusOr<std::optional<Job>> FindRequestedJob(JobTable& table, const std::string& owner,
                                                    const std::string& request_id, const std::string& body_hash) {
  if (request_id.empty()) return std::optional<Job>();
  std::optional<JobRow> row = table.FindRequest(owner, request_id);
  if (!row.has_value()) return std::optional<Job>();
  if (row->body_hash != body_hash) {
    return absl::AlreadyExistsError("request_id was used for another request: choose a new one for this.");
  }
  return std::optional<Job>(std::move(row->job));
}

absl::StatusOr<JobStore::Created> CreateJob(JobTable& table, const NewJob& job) {
  if (!IsJobId(job.id)) return absl::InvalidArgumentError("A job's id is made by NewJobId().");
  absl::StatusOr<std::optional<Job>> earlier = FindRequestedJob(table, job.owner, job.request_id, job.body_hash);
  if (!earlier.ok()) return earlier.status();
  if (earlier->has_value()) return JobStore::Created{.job = **std::move(earlier), .existed = true};
  if (!job.problem.empty() && !table.UseProblem(job.owner, job.problem)) return NoSuchProblem(job.problem);
  std::optional<JobRow> row = table.Insert(job);
  if (!row.has_value()) {
    // Another server has just taken the same request.
    earlier = FindRequestedJob(table, job.owner, job.request_id, job.body_hash);
    if (!earlier.ok()) return earlier.status();
    if (!earlier->has_value()) return absl::UnavailableError("The same request is being deleted: send it again.");
    return JobStore::Created{.job = **std::move(earlier), .existed = true};
  }
  if (IsEnsemble(row->job)) {
    // So that servers that know no ensembles do not claim it.
    row->lease_until = Time::max();
    EnterState(table, *row, JobState::kRunning);
  } else {
    EnterState(table, *row, JobState::kQueued);
  }
  table.Save(*row);
  return JobStore::Created{.job = std::move(row->job), .existed = false};
}

absl::StatusOr<Job> VisibleJob(const std::optional<JobRow>& row, const std::optional<std::string>& owner,
                               const JobId& id) {
  if (!row.has_value() || (owner.has_value() && row->job.owner != *owner)) return NoSuchJob(id);
  return row->job;
}

absl::StatusOr<Job> RequestCancelOfJob(JobTable& table, const std::optional<std::string>& owner, const JobId& id) {
  std::optional<JobRow> row = table.Lock(id);
  if (absl::Status status = VisibleJob(row, owner, id).status(); !status.ok()) return status;
  if (row->job.state == JobState::kQueued) {
    EnterState(table, *row, JobState::kCancelled);
    AddSummary(table, *row);
    row->job.finished = row->now;
    table.Save(*row);
  } else if (IsEnsemble(row->job) && !IsFinal(row->job.state)) {
    EndEnsemble(table, *row, JobState::kCancelled, absl::OkStatus());
  } else if (row->job.state == JobState::kRunning) {
    // The holder of the lease writes the event, since the numbers above the mark belong to it.
    row->job.state = JobState::kCancelling;
    table.Save(*row);
  }
  return std::move(row->job);
}

absl::Status DeleteJob(JobTable& table, const std::optional<std::string>& owner, const JobId& id) {
  const std::optional<JobRow> row = table.Lock(id);
  if (absl::Status status = VisibleJob(row, owner, id).status(); !status.ok()) return status;
  if (!IsFinal(row->job.state)) {
    return absl::FailedPreconditionError(
        fmt::format("The job is {}: cancel it and wait for its end first.", JobStateName(row->job.state)));
  }
  table.Delete(row->number);
  return absl::OkStatus();
}

absl::StatusOr<std::optional<ClaimedJob>> ClaimJob(JobTable& table, const std::string& worker, Duration lease,
                                                   std::span<const JobId> candidates) {
  std::optional<JobRow> row = table.LockClaimable(candidates);
  if (!row.has_value()) {
    for (const JobId& id : table.EnsemblesAmong(candidates)) {
      // Waits for others that claim or end a shard at this moment: they take milliseconds.
      std::optional<JobRow> ensemble = table.Lock(id);
      if (!ensemble.has_value() || IsFinal(ensemble->job.state)) continue;
      std::optional<ClaimedJob> claimed = ClaimShard(table, *std::move(ensemble), worker, lease);
      if (claimed.has_value()) return claimed;
    }
    return std::optional<ClaimedJob>();
  }
  row->worker = worker;
  row->lease_until = row->now + lease;
  ++row->fence;
  ++row->job.attempts;
  if (!row->job.started.has_value()) row->job.started = row->now;
  EnterState(table, *row, row->job.state == JobState::kCancelling ? JobState::kCancelling : JobState::kRunning);
  table.Save(*row);
  ClaimedJob claimed{.job = std::move(row->job),
                     .lease = {.job = {}, .worker = worker, .fence = row->fence},
                     .body = table.ReadBody(row->number),
                     .resume_state = table.ReadResumeState(row->number)};
  claimed.lease.job = claimed.job.id;
  return std::optional<ClaimedJob>(std::move(claimed));
}

absl::StatusOr<bool> RenewLeaseOfJob(JobTable& table, const Lease& lease, Duration duration) {
  if (lease.shard.has_value()) {
    absl::StatusOr<HeldShard> held = HeldShardOf(table, lease);
    if (!held.ok()) return held.status();
    held->shard.lease_until = held->row.now + duration;
    table.SaveShard(held->row.number, held->shard);
    return false;
  }
  absl::StatusOr<JobRow> row = HeldAndRunning(table, lease);
  if (!row.ok()) return row.status();
  row->lease_until = row->now + duration;
  table.Save(*row);
  return row->job.state == JobState::kCancelling;
}

absl::Status AppendToJob(JobTable& table, const Lease& lease, const Progress& progress) {
  absl::StatusOr<JobRow> row = HeldAndRunning(table, lease);
  if (!row.ok()) return row.status();
  for (const Chunk& chunk : progress.chunks) {
    if (chunk.number > row->job.chunks) {
      return absl::InvalidArgumentError("Parts of the trajectory must follow one another.");
    }
    AddChunk(table, *row, chunk);
  }
  if (progress.state.has_value()) table.SaveResumeState(row->number, *progress.state);
  for (const Event& event : progress.events) AddEvent(table, *row, event);
  row->job.sequence = std::max(row->job.sequence, progress.reserve_through);
  row->job.progress = std::max(row->job.progress, progress.progress);
  table.Save(*row);
  return absl::OkStatus();
}

absl::Status FinishJob(JobTable& table, const Lease& lease, const Outcome& outcome) {
  const bool is_ensemble = lease.shard.has_value();  // which writes its own events
  const bool has_summary = !outcome.events.empty() && outcome.events.back().kind == EventKind::kSummary;
  if (!IsFinal(outcome.state) || (!is_ensemble && !has_summary)) {
    return absl::InvalidArgumentError("A job ends in a final state and with its summary.");
  }
  if (is_ensemble) {
    absl::StatusOr<HeldShard> held = HeldShardOf(table, lease);
    if (!held.ok()) return held.status();
    EndEnsemble(table, held->row, outcome.state, outcome.error);
    return absl::OkStatus();
  }
  absl::StatusOr<JobRow> row = Held(table, lease);
  if (!row.ok()) return row.status();
  Job& job = row->job;
  // The same request again: the first response was lost.
  if (job.state == outcome.state) return absl::OkStatus();
  if (absl::Status status = CheckRunning(*row); !status.ok()) return status;
  for (const Event& event : outcome.events) AddEvent(table, *row, event);
  job.state = outcome.state;
  job.finished = row->now;
  job.error = outcome.error;
  job.tally = outcome.tally;
  // Unused reserved numbers are released: no event follows the summary.
  job.sequence = outcome.events.back().sequence;
  if (outcome.state == JobState::kSucceeded) job.progress = 1;
  row->lease_until = {};
  table.Save(*row);
  table.DropResumeState(row->number);
  return absl::OkStatus();
}

absl::Status FinishShardOfJob(JobTable& table, const Lease& lease, const ShardResult& result) {
  absl::StatusOr<HeldShard> held = HeldShardOf(table, lease);
  if (!held.ok()) return held.status();
  JobRow& row = held->row;
  Job& job = row.job;
  ShardResult::Count count = result.count(job);
  AddChunk(table, row, {.number = job.chunks, .begin = result.begin, .end = result.end, .data = result.data});
  job.progress = static_cast<double>(job.chunks) / static_cast<double>(job.shards);
  job.tally = std::move(count.tally);
  AddEvent(table, row,
           {.sequence = job.sequence + 1,
            .time = row.now,
            .kind = EventKind::kWindowAccepted,
            .payload = std::make_shared<const std::string>(std::move(count.event))});
  if (job.chunks == job.shards) {
    EndEnsemble(table, row, JobState::kSucceeded, absl::OkStatus());
    return absl::OkStatus();
  }
  table.DropShards(row.number, held->shard.number);
  table.Save(row);
  return absl::OkStatus();
}

absl::Status ReleaseJob(JobTable& table, const Lease& lease, std::int64_t through, bool in_vain) {
  if (lease.shard.has_value()) {
    absl::StatusOr<HeldShard> held = HeldShardOf(table, lease);
    if (!held.ok()) return held.status();
    held->shard.lease_until = {};
    if (!in_vain) held->shard.attempts = 0;
    table.SaveShard(held->row.number, held->shard);
    return absl::OkStatus();
  }
  absl::StatusOr<JobRow> row = HeldAndRunning(table, lease);
  if (!row.ok()) return row.status();
  row->job.sequence = through;
  if (!in_vain) row->job.attempts = 0;
  row->lease_until = {};
  if (row->job.state == JobState::kRunning) EnterState(table, *row, JobState::kQueued);
  table.Save(*row);
  return absl::OkStatus();
}

absl::StatusOr<std::int64_t> BeginOfPage(const std::string& page_token, int page_size) {
  const absl::Status refusal = absl::InvalidArgumentError("page_token: is not the token of a page.");
  if (page_size < 1) return refusal;
  if (page_token.empty()) return std::numeric_limits<std::int64_t>::max();
  std::int64_t number = 0;
  const char* end = page_token.data() + page_token.size();
  const auto [stop, error] = std::from_chars(page_token.data(), end, number);
  if (error != std::errc() || stop != end || number < 1) return refusal;
  return number;
}

std::int64_t MaskOf(const std::vector<JobState>& states) {
  if (states.empty()) return ~std::int64_t{0};
  std::int64_t mask = 0;
  for (const JobState state : states) mask |= std::int64_t{1} << static_cast<int>(state);
  return mask;
}

}  // namespace dlcs::jobs
