// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/job_run.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace dlcs::jobs {
namespace {

bool IsEmpty(const Progress& progress) {
  return progress.chunks.empty() && progress.events.empty() && progress.reserve_through == 0;
}

void AddTo(Progress& earlier, Progress later) {
  std::move(later.chunks.begin(), later.chunks.end(), std::back_inserter(earlier.chunks));
  std::move(later.events.begin(), later.events.end(), std::back_inserter(earlier.events));
  if (later.state.has_value()) earlier.state = std::move(later.state);
  earlier.reserve_through = std::max(earlier.reserve_through, later.reserve_through);
  earlier.progress = std::max(earlier.progress, later.progress);
}

}  // namespace

JobRun::JobRun(ClaimedJob job, int threads, std::shared_ptr<EventLog> log, WriteRequest request_write)
    : job_(std::move(job)),
      threads_(threads),
      log_(std::move(log)),
      request_write_(std::move(request_write)),
      next_chunk_(job_.job.chunks),
      reported_cancelling_(job_.job.state == JobState::kCancelling) {}

void JobRun::Emit(EventKind kind, std::string payload) {
  if (!IsDurable(kind)) {
    log_->Append(kind, std::move(payload));
    if (log_->WantedReservation() > 0) RequestWrite();
    return;
  }
  {
    const std::lock_guard lock(pending_mutex_);
    AppendDurable(kind, std::move(payload));
  }
  RequestWrite();
}

void JobRun::Accept(AcceptedWindow window) {
  {
    const std::lock_guard lock(pending_mutex_);
    pending_.chunks.push_back(
        {.number = next_chunk_++, .begin = window.begin, .end = window.end, .data = std::move(window.trajectory)});
    if (window.state.has_value()) pending_.state = std::move(window.state);
    pending_.progress = window.progress;
    AppendDurable(EventKind::kWindowAccepted, std::move(window.event));
  }
  RequestWrite();
}

void JobRun::AppendDurable(EventKind kind, std::string payload) {
  Event event = log_->Append(kind, std::move(payload));
  if (event.sequence > 0) pending_.events.push_back(std::move(event));
}

void JobRun::RequestWrite() {
  if (!write_requested_.exchange(true)) request_write_(weak_from_this());
}

void JobRun::Stop(StopCause cause) {
  StopCause none = StopCause::kNone;
  cause_.compare_exchange_strong(none, cause);
  stop_source_.request_stop();
}

void JobRun::ReportCancelling() {
  {
    const std::lock_guard lock(pending_mutex_);
    if (std::exchange(reported_cancelling_, true)) return;
    AppendDurable(EventKind::kState, JobStateName(JobState::kCancelling));
  }
  RequestWrite();
}

absl::Status JobRun::Write(JobStore& store) {
  const std::lock_guard write_lock(write_mutex_);
  if (outcome_.has_value()) return absl::OkStatus();  // too late: Finish() writes the rest
  write_requested_ = false;
  {
    const std::lock_guard lock(pending_mutex_);
    AddTo(unwritten_, std::exchange(pending_, {}));
  }
  unwritten_.reserve_through = std::max(unwritten_.reserve_through, log_->WantedReservation());
  if (IsEmpty(unwritten_)) return absl::OkStatus();
  if (absl::Status status = store.Append(job_.lease, unwritten_); !status.ok()) return status;
  // The mark is at the last event at least.
  if (!unwritten_.events.empty()) {
    const std::int64_t last = unwritten_.events.back().sequence;
    log_->Reserve(last);
    log_->MarkStored(last);
  }
  log_->Reserve(unwritten_.reserve_through);
  unwritten_ = {};
  return absl::OkStatus();
}

absl::Status JobRun::Finish(JobStore& store, JobState state, const absl::Status& error, const std::string& summary,
                            const std::string& tally) {
  if (is_shard()) return store.Finish(job_.lease, {.state = state, .error = error, .events = {}});
  if (absl::Status status = Write(store); !status.ok()) return status;
  const std::lock_guard write_lock(write_mutex_);
  if (!outcome_.has_value()) {
    const std::lock_guard lock(pending_mutex_);
    outcome_ = Outcome{.state = state, .error = error, .events = std::exchange(pending_, {}).events, .tally = tally};
    outcome_->events.push_back(log_->Append(EventKind::kState, JobStateName(state)));
    outcome_->events.push_back(log_->Append(EventKind::kSummary, summary));
  }
  if (absl::Status status = store.Finish(job_.lease, *outcome_); !status.ok()) return status;
  const std::int64_t last = outcome_->events.back().sequence;
  log_->Reserve(last);
  log_->MarkStored(last);
  return absl::OkStatus();
}

absl::Status JobRun::Release(JobStore& store, bool in_vain) {
  if (is_shard()) return store.Release(job_.lease, 0, in_vain);
  if (absl::Status status = Write(store); !status.ok()) return status;
  const std::lock_guard write_lock(write_mutex_);
  const std::int64_t last = log_->last_sequence();
  if (absl::Status status = store.Release(job_.lease, last, in_vain); !status.ok()) return status;
  // The store writes the event QUEUED, with the next number.
  log_->AdvanceArchive(last + 1, false);
  return absl::OkStatus();
}

}  // namespace dlcs::jobs
