// SPDX-License-Identifier: Apache-2.0
// Periodic work of the job manager: leases, deadlines, jobs and events of other servers, expiry, the store's health.
#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "server/jobs/job_manager.h"

namespace dlcs::jobs {
namespace {

// Minimum time between two polls of the queue that notifications request, since submissions arrive in bursts.
constexpr std::chrono::milliseconds kMinPollInterval{20};

// A periodic task.
class PeriodicTask {
 public:
  PeriodicTask(Duration period, Duration now) : period_(period), next_(now + period) {}
  bool Due(Duration now) {
    if (now < next_) return false;
    next_ = now + period_;
    return true;
  }
  Duration next() const { return next_; }

 private:
  const Duration period_;
  Duration next_;
};

}  // namespace

void JobManager::RunMaintenance() {
  const Duration begin = clock_.Elapsed();
  PeriodicTask poll(options_.poll, begin);
  PeriodicTask renew(options_.lease / 4, begin);
  PeriodicTask ask(options_.ask, begin);
  PeriodicTask probe(options_.probe, begin);
  PeriodicTask expire(options_.expire_every, begin);
  Duration next_poll = begin;
  std::unique_lock lock(mutex_);
  while (!ending_) {
    Duration due = std::min({poll.next(), renew.next(), ask.next(), probe.next(), expire.next()});
    if (ShouldPoll()) due = std::min(due, next_poll);
    Duration pause = changed_jobs_.empty() && !interest_changed_ ? due - clock_.Elapsed() : Duration::zero();
    if (const auto deadline = NextDeadline()) pause = std::min(pause, *deadline - clock_.Now());
    if (pause > Duration::zero()) house_.wait_for(lock, pause);
    if (ending_) return;
    const Duration now = clock_.Elapsed();
    const std::set<JobId> changed = std::exchange(changed_jobs_, {});
    const bool look = ShouldPoll() && now >= next_poll;
    const bool asks = std::exchange(interest_changed_, false);
    if (look) {
      next_poll = now + kMinPollInterval;
      work_announced_ = was_notified_ = false;
    }
    lock.unlock();
    EnforceDeadlines();
    for (const JobId& id : changed) Refresh(id);
    if (renew.Due(now)) RenewLeases();
    const bool polls = poll.Due(now);
    if (polls || look) {
      FailUnmeetable();
      ReclaimJobs();
      FollowRemoteJobs();
    }
    if (polls) MeasureQueue();
    if (ask.Due(now) || asks) PublishInterest();
    // The results of these are not used; Healthy() reports failures.
    if (probe.Due(now)) store_.Probe().IgnoreError();
    if (expire.Due(now)) store_.Expire(options_.expiry).status().IgnoreError();
    lock.lock();
  }
}

void JobManager::ReclaimJobs() {
  std::set<JobId> gone;  // unless the store says otherwise: claimed or cancelled elsewhere
  {
    const std::lock_guard lock(mutex_);
    if (draining_) return;
    const std::vector<JobId> queued = scheduler_.QueuedIds();
    gone.insert(queued.begin(), queued.end());
  }
  if (!leases_released_) {
    // Leases of an earlier process: this one has not claimed anything yet.
    if (!store_.ReleaseLeases(options_.worker).ok()) {
      const std::lock_guard lock(mutex_);
      idle_since_ = clock_.Elapsed();
      return;
    }
    leases_released_ = true;
  }
  const absl::StatusOr<std::vector<Job>> jobs = store_.ListClaimable(options_.limits.max_queued_jobs);
  const std::lock_guard lock(mutex_);
  const auto is_for_us = [this](const Job& job) { return CanRun(job.about); };
  if (!jobs.ok() || std::any_of(jobs->begin(), jobs->end(), is_for_us)) idle_since_ = clock_.Elapsed();
  if (!jobs.ok()) return;
  for (const Job& job : *jobs) {
    gone.erase(job.id);
    if (!scheduler_.Knows(job.id) && !active_.contains(job.id)) scheduler_.Restore(RequestOf(job));
  }
  if (jobs->size() < static_cast<std::size_t>(options_.limits.max_queued_jobs)) {
    for (const JobId& id : gone) {
      if (!active_.contains(id)) scheduler_.Remove(id);
    }
  }
  work_.notify_all();
}

void JobManager::MeasureQueue() {
  {
    const std::lock_guard lock(mutex_);
    if (clock_.Elapsed() >= depth_wanted_until_) {
      depth_.reset();
      return;
    }
  }
  const absl::StatusOr<QueueDepth> depth = store_.MeasureQueue();
  const std::lock_guard lock(mutex_);
  depth_ = depth.ok() ? std::optional(*depth) : std::nullopt;
  depth_read_ = clock_.Elapsed();
}

void JobManager::FollowRemoteJobs() {
  std::vector<JobId> others;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(logs_, [](const auto& entry) { return entry.second.expired(); });
    std::erase_if(watched_elsewhere_,
                  [now = clock_.Elapsed()](const auto& entry) { return entry.second.until <= now; });
    for (const auto& [id, weak] : logs_) {
      const auto log = weak.lock();
      if (log != nullptr && !log->closed() && !HasEventsOf(id)) others.push_back(id);
    }
  }
  for (const JobId& id : others) FollowRemoteJob(id);
}

void JobManager::FollowRemoteJob(const JobId& id) {
  const absl::StatusOr<Job> job = store_.Get(std::nullopt, id);
  if (!job.ok() && !absl::IsNotFound(job.status())) return;
  const std::lock_guard lock(mutex_);
  const auto found = logs_.find(id);
  // Once this server has the job, events come from the run.
  if (found == logs_.end() || HasEventsOf(id)) return;
  if (const auto active = active_.find(id); active != active_.end() && job.ok() && IsFinal(job->state)) {
    active->second.run->Stop(StopCause::kLeaseLost);  // the ensemble ended elsewhere
  }
  const std::shared_ptr<EventLog> log = found->second.lock();
  if (log == nullptr) return;
  if (job.ok()) {
    log->AdvanceArchive(job->last_event, IsFinal(job->state));
  } else {
    // Deleted: watchers are sent to the store, which reports that.
    log->AdvanceArchive(log->last_sequence() + 1, true);
  }
}

void JobManager::PublishInterest() {
  std::vector<JobChange> questions;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, weak] : logs_) {
      const auto log = weak.lock();
      if (log == nullptr || log->closed() || HasEventsOf(id)) continue;
      // Shards have no events but those in the store.
      if (log->HasFullWatchers() && !active_.contains(id)) {
        questions.push_back({.what = JobChange::What::kWatched, .job = id, .detail = *log->WantedDetail()});
      } else {
        questions.push_back({.what = JobChange::What::kFollowed, .job = id});
      }
    }
  }
  for (const JobChange& question : questions) store_.Publish(question);
}

void JobManager::OnStoreChange(const JobChange& change) {
  {
    const std::lock_guard lock(mutex_);
    const auto active = active_.find(change.job);
    const bool is_ours = active != active_.end();
    switch (change.what) {
      case JobChange::What::kClaimable:
        // A busy server polls when it has a free core.
        work_announced_ = options_.runs_jobs;
        break;
      case JobChange::What::kEvents:
        if (HasEventsOf(change.job) || !logs_.contains(change.job)) return;
        changed_jobs_.insert(change.job);
        break;
      case JobChange::What::kCancelling:
        if (!is_ours) {
          ++cancels_;
          return;
        }
        changed_jobs_.insert(change.job);
        break;
      case JobChange::What::kUnknown:
        was_notified_ = true;
        break;
      case JobChange::What::kFollowed:
        return;  // the store notifies followers
      case JobChange::What::kWatched:
        if (!options_.runs_jobs) return;
        // It may start here in a moment.
        watched_elsewhere_[change.job] = {clock_.Elapsed() + EventRelay::kFor, change.detail};
        if (is_ours && active->second.run) relay_.Want(change.job, active->second.run->log(), change.detail);
        return;
      case JobChange::What::kTransient:
        if (const auto log = logs_.find(change.job); !is_ours && log != logs_.end()) {
          if (const auto live = log->second.lock()) live->AppendRelayed(change.event, change.durable_before);
        }
        return;
    }
  }
  house_.notify_one();
}

bool JobManager::ShouldPoll() const { return was_notified_ || (work_announced_ && scheduler_.has_free_cores()); }

void JobManager::Refresh(const JobId& id) {
  std::shared_ptr<JobRun> run;
  {
    const std::lock_guard lock(mutex_);
    if (const auto active = active_.find(id); active != active_.end()) run = active->second.run;
  }
  if (run != nullptr && !run->is_shard()) {
    RenewLease(*run);
  } else {
    FollowRemoteJob(id);
  }
}

std::vector<std::shared_ptr<JobRun>> JobManager::Runs() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<JobRun>> runs;
  for (const auto& [id, active] : active_) {
    if (active.run != nullptr) runs.push_back(active.run);
  }
  return runs;
}

void JobManager::RenewLeases() {
  for (const std::shared_ptr<JobRun>& run : Runs()) RenewLease(*run);
}

void JobManager::RenewLease(JobRun& run) {
  const absl::StatusOr<bool> cancelled = store_.RenewLease(run.lease(), options_.lease);
  if (absl::IsAborted(cancelled.status())) {
    // The job has ended, or its lease was lost: there is nothing to renew.
    run.Stop(StopCause::kLeaseLost);
  } else if (cancelled.ok() && *cancelled) {
    run.Stop(StopCause::kCancelled);
    run.ReportCancelling();
  }
}

std::optional<Time> JobManager::NextDeadline() const {
  std::optional<Time> next;
  for (const auto& [id, active] : active_) {
    if (active.run == nullptr || active.run->stop().stop_requested()) continue;
    const std::optional<Time>& deadline = active.run->job().deadline;
    if (deadline.has_value() && (!next.has_value() || *deadline < *next)) next = deadline;
  }
  return next;
}

void JobManager::EnforceDeadlines() {
  const Time now = clock_.Now();
  for (const std::shared_ptr<JobRun>& run : Runs()) {
    const std::optional<Time>& deadline = run->job().deadline;
    if (deadline.has_value() && *deadline <= now) run->Stop(StopCause::kDeadline);
  }
}

void JobManager::FailUnmeetable() {
  std::vector<JobId> unmeetable;
  {
    const std::lock_guard lock(mutex_);
    unmeetable = scheduler_.TakeUnmeetable();
  }
  for (const JobId& id : unmeetable) {
    const JobId candidates[] = {id};
    auto claimed = store_.Claim(options_.worker, options_.lease, candidates);
    if (!claimed.ok() || !claimed->has_value()) continue;  // found again by ReclaimJobs(), if it is still there
    const Job job = (*claimed)->job;
    const std::shared_ptr<EventLog> log = LogOf(job);
    log->AdvanceArchive(job.last_event, false);
    const auto run = std::make_shared<JobRun>(**std::move(claimed), 1, log, [](const std::weak_ptr<JobRun>&) {});
    const absl::Status late = absl::DeadlineExceededError(
        run->is_shard() ? kDeadlineOfEnsemble
                        : "While the job was queued, the time left before its deadline became too short.");
    // After a failure the lease expires.
    run->Finish(store_, JobState::kFailed, late, "", "").IgnoreError();
  }
}

}  // namespace dlcs::jobs
