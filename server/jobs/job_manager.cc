// SPDX-License-Identifier: Apache-2.0
// Requests of users, and running jobs. Periodic work is in job_housekeeping.cc.
#include "server/jobs/job_manager.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "fmt/format.h"
#include "server/jobs/catch_exceptions.h"

namespace dlcs::jobs {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstPause{10};
constexpr milliseconds kLongestPause{1000};
constexpr std::chrono::seconds kPatienceWithTheStore{2};
// The interval at which a job that does not fit is considered again; the end of another job is noticed at once.
constexpr milliseconds kRetryInterval{500};

// The queue is measured only while load() is called at least this often, since the store must read every queued job for
// it.
constexpr std::chrono::minutes kDepthInterest{3};
// Older figures are not reported: the store does not answer, and the housekeeper waits for it.
constexpr std::chrono::seconds kMaxDepthAge{10};

// The most alternatives in one claim. If many servers claim the same jobs, other servers claim about this many between
// two polls of this one.
constexpr int kMaxAlternatives = 100;

absl::Status Draining() { return absl::UnavailableError("The server is shutting down: try another one, or later."); }

}  // namespace

JobManager::JobManager(JobManagerOptions options, JobStore& store, CostModel cost, SolveFunction solve,
                       const Clock& clock)
    : options_(std::move(options)),
      store_(store),
      cost_(std::move(cost)),
      solve_(std::move(solve)),
      clock_(clock),
      dispatcher_(clock),
      writer_(store),
      relay_(store, clock),
      scheduler_(options_.limits, clock),
      idle_since_(clock.Elapsed()) {
  ReclaimJobs();
  threads_.emplace_back([this] { RunMaintenance(); });
  // While a job waits for the store at its end, the next one uses its cores.
  const SchedulerLimits& limits = options_.limits;
  const int threads = options_.runs_jobs ? 2 * limits.cores + limits.burst_cores : 0;
  for (int k = 0; k < threads; ++k) threads_.emplace_back([this] { Work(); });
  store_.Subscribe([this](const JobChange& change) { OnStoreChange(change); });
}

JobManager::~JobManager() {
  store_.Subscribe({});
  Drain(Duration(0));
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  work_.notify_all();
  house_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

Scheduler::Request JobManager::RequestOf(const Job& job) const {
  return {.id = job.id,
          .owner = job.owner,
          .priority = job.priority,
          .demand = job.demand,
          .deadline = job.deadline,
          .takes_free_cores = job.shards > 0,
          .is_for_others = !CanRun(job.about)};
}

Scheduler::Request JobManager::RequestOf(const NewJob& job) const {
  return {.id = job.id,
          .owner = job.owner,
          .priority = job.priority,
          .demand = job.demand,
          .deadline = job.deadline,
          .takes_free_cores = !job.shards.empty(),
          .is_for_others = !CanRun(job.about)};
}

absl::StatusOr<Demand> JobManager::DemandOf(const Submission& submission) const {
  return submission.demand.has_value() ? *submission.demand : cost_(submission);
}

absl::StatusOr<Demand> JobManager::Check(const Submission& submission) const {
  absl::StatusOr<Demand> demand = DemandOf(submission);
  if (!demand.ok()) return demand;
  const std::lock_guard lock(mutex_);
  if (draining_) return Draining();
  const auto refusal = scheduler_.Refuse({.id = "",
                                          .owner = submission.owner,
                                          .priority = submission.priority,
                                          .demand = *demand,
                                          .deadline = submission.deadline,
                                          .takes_free_cores = !submission.shards.empty()});
  if (refusal.has_value()) return ToStatus(*refusal);
  return demand;
}

absl::Status JobManager::CheckQueueSpace(const std::string& owner) const {
  const std::lock_guard lock(mutex_);
  if (draining_) return Draining();
  const std::optional<Refusal> refusal = scheduler_.RefuseIfFull(owner);
  return refusal.has_value() ? ToStatus(*refusal) : absl::OkStatus();
}

absl::StatusOr<JobStore::Created> JobManager::Submit(const Submission& submission) {
  // First, so that a repeated request finds its job even if the queue is full.
  absl::StatusOr<std::optional<Job>> earlier =
      store_.FindRequest(submission.owner, submission.request_id, submission.body_hash);
  if (!earlier.ok()) return earlier.status();
  if (earlier->has_value()) return JobStore::Created{.job = **std::move(earlier), .existed = true};
  // Checked first, since predicting takes longer than refusing.
  if (absl::Status full = CheckQueueSpace(submission.owner); !full.ok()) return full;

  const absl::StatusOr<Demand> demand = DemandOf(submission);
  if (!demand.ok()) return demand.status();
  const NewJob job{.id = NewJobId(),
                   .owner = submission.owner,
                   .request_id = submission.request_id,
                   .body_hash = submission.body_hash,
                   .body = submission.body,
                   .problem = submission.problem,
                   .about = submission.about,
                   .priority = submission.priority,
                   .demand = *demand,
                   .deadline = submission.deadline,
                   .shards = submission.shards};
  {
    const std::lock_guard lock(mutex_);
    if (draining_) return Draining();
    const auto refusal = scheduler_.Reserve(RequestOf(job));
    if (refusal.has_value()) return ToStatus(*refusal);
  }
  absl::StatusOr<JobStore::Created> created = store_.Create(job);
  {
    const std::lock_guard lock(mutex_);
    if (created.ok() && !created->existed) {
      scheduler_.Confirm(job.id);
    } else {
      scheduler_.Remove(job.id);
    }
  }
  work_.notify_one();
  return created;
}

absl::StatusOr<Job> JobManager::Cancel(const std::optional<std::string>& owner, const JobId& id) {
  absl::StatusOr<Job> job = store_.RequestCancel(owner, id);
  if (!job.ok()) return job;
  std::shared_ptr<JobRun> run;
  {
    const std::lock_guard lock(mutex_);
    if (IsFinal(job->state)) scheduler_.Remove(id);
    if (const auto active = active_.find(id); active != active_.end()) {
      active->second.cancelled = true;
      run = active->second.run;
    } else {
      ++cancels_;
    }
    if (const auto log = logs_.find(id); log != logs_.end() && !HasEventsOf(id)) {
      if (const auto live = log->second.lock()) live->AdvanceArchive(job->last_event, IsFinal(job->state));
    }
  }
  if (run == nullptr) return job;
  if (run->is_shard()) {
    run->Stop(StopCause::kCancelled);
  } else if (job->state == JobState::kCancelling) {
    run->ReportCancelling();  // first, since the run may end at once
    run->Stop(StopCause::kCancelled);
  }
  return job;
}

absl::Status JobManager::Delete(const std::optional<std::string>& owner, const JobId& id) {
  return store_.Delete(owner, id);
}

absl::StatusOr<std::unique_ptr<JobWatch>> JobManager::Watch(const std::optional<std::string>& owner, const JobId& id,
                                                            const EventWatchOptions& options,
                                                            std::function<void()> ready) {
  const absl::StatusOr<Job> job = store_.Get(owner, id);
  if (!job.ok()) return job.status();
  if (options.after < 0 || options.after > job->sequence) {
    return absl::OutOfRangeError(fmt::format("No event of this job has the number {}.", options.after));
  }
  auto watch = std::make_unique<JobWatch>(store_, id, LogOf(*job), options, std::move(ready));
  if (!IsFinal(job->state)) {
    const std::lock_guard lock(mutex_);
    interest_changed_ = interest_changed_ || !HasEventsOf(id);
    if (interest_changed_) house_.notify_one();
  }
  return watch;
}

std::shared_ptr<EventLog> JobManager::LogOf(const Job& job) {
  const std::lock_guard lock(mutex_);
  if (auto log = logs_[job.id].lock()) return log;
  auto log = std::make_shared<EventLog>(options_.log, clock_, &dispatcher_, job.last_event);
  logs_[job.id] = log;
  if (IsFinal(job.state)) {
    log->AdvanceArchive(job.last_event, true);
  } else if (!HasEventsOf(job.id)) {
    // Notifications of other servers since `job` was read were lost, because there was no log.
    changed_jobs_.insert(job.id);
    house_.notify_one();
  }
  return log;
}

bool JobManager::HasEventsOf(const JobId& id) const {
  const auto active = active_.find(id);
  return active != active_.end() && (active->second.run == nullptr || !active->second.run->is_shard());
}

bool JobManager::Healthy() const {
  const std::lock_guard lock(mutex_);
  return !draining_ && store_.Healthy();
}

JobManager::Load JobManager::load() const {
  const std::lock_guard lock(mutex_);
  depth_wanted_until_ = clock_.Elapsed() + kDepthInterest;
  const bool is_measured = depth_ && clock_.Elapsed() - depth_read_ < kMaxDepthAge;
  const QueueDepth depth = is_measured ? *depth_ : QueueDepth();
  // The scheduler knows jobs that were submitted after the last poll, but not all that are in the store.
  return {.queued = std::max<std::int64_t>(scheduler_.queued(), depth.jobs),
          .queued_core_seconds = std::max(scheduler_.queued_core_seconds(), depth.core_seconds),
          .oldest_queued_age = depth.oldest_age,
          .is_measured = is_measured,
          .running = scheduler_.running()};
}

Duration JobManager::idle_for() const {
  const std::lock_guard lock(mutex_);
  if (!active_.empty()) return Duration::zero();
  return clock_.Elapsed() - idle_since_;
}

void JobManager::Drain(Duration grace) {
  std::unique_lock lock(mutex_);
  draining_ = true;
  const auto is_idle = [this] { return active_.empty(); };
  if (idle_.wait_for(lock, grace, is_idle)) return;
  for (const auto& [id, active] : active_) {
    if (active.run != nullptr) active.run->Stop(StopCause::kDrain);
  }
  if (idle_.wait_for(lock, kPatienceWithTheStore, is_idle)) return;
  abandoning_ = true;
  work_.notify_all();
  idle_.wait(lock, is_idle);
}

void JobManager::Work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    std::optional<Scheduler::Start> start;
    if (!draining_ && leases_released_) start = scheduler_.StartNext();
    if (start.has_value()) {
      active_[start->id] = {};
      work_.notify_one();  // there may be room for another
      lock.unlock();
      const std::optional<Scheduler::Request> next = RunJob(*start);
      lock.lock();
      active_.erase(start->id);
      if (next.has_value() && !scheduler_.Knows(next->id)) scheduler_.Restore(*next);
      idle_since_ = clock_.Elapsed();
      if (active_.empty()) idle_.notify_all();
      if (work_announced_) house_.notify_one();
      work_.notify_one();
    } else if (ending_) {
      return;
    } else {
      work_.wait_for(lock, kRetryInterval);
    }
  }
}

std::optional<Scheduler::Request> JobManager::RunJob(Scheduler::Start& start) {
  std::optional<Scheduler::Request> next;
  const Duration began = clock_.Elapsed();
  const auto core_seconds = [&] {
    return std::chrono::duration<double>(clock_.Elapsed() - began).count() * start.threads;
  };
  if (const std::shared_ptr<JobRun> run = Begin(start)) {
    house_.notify_one();  // it may have a deadline
    const JobEnd end = Solve(*run);
    {
      const std::lock_guard lock(mutex_);
      scheduler_.GiveBackCores(start.id, core_seconds());
      if (work_announced_) house_.notify_one();
    }
    work_.notify_one();
    End(*run, end);
    if (run->is_shard()) {
      next = RequestOf(run->job());
      Refresh(start.id);
    }
  }
  const std::lock_guard lock(mutex_);
  scheduler_.Finished(start.id, core_seconds());
  return next;
}

std::optional<ClaimedJob> JobManager::Claim(Scheduler::Start& start) {
  std::vector<JobId> candidates = {start.id};
  std::int64_t cancels_before = 0;
  {
    const std::lock_guard lock(mutex_);
    const std::vector<JobId> others = scheduler_.SetAside(start.id, kMaxAlternatives);
    candidates.insert(candidates.end(), others.begin(), others.end());
    cancels_before = cancels_;
  }
  absl::StatusOr<std::optional<ClaimedJob>> claimed = store_.Claim(options_.worker, options_.lease, candidates);
  const std::lock_guard lock(mutex_);
  if (!claimed.ok()) {
    // The housekeeper finds this job again; the others remain in the queue.
    scheduler_.PutBack(start.id);
    return std::nullopt;
  }
  if (!claimed->has_value()) {
    scheduler_.Settle(start.id, std::nullopt);
    return std::nullopt;
  }
  const Scheduler::Start started = *scheduler_.Settle(start.id, RequestOf((*claimed)->job));
  if (started.id == start.id) return *std::move(claimed);
  active_.erase(start.id);
  active_[started.id] = {};
  // Notifications about the first job were ignored while this server seemed to have it. A request to stop the other one
  // may have arrived before it was claimed.
  if (logs_.contains(start.id)) changed_jobs_.insert(start.id);
  if (cancels_ != cancels_before) changed_jobs_.insert(started.id);
  house_.notify_one();
  start = started;
  return *std::move(claimed);
}

std::shared_ptr<JobRun> JobManager::Begin(Scheduler::Start& start) {
  std::optional<ClaimedJob> claimed = Claim(start);
  work_.notify_one();  // alternatives that were set aside can start
  if (!claimed.has_value()) return nullptr;
  const Job job = claimed->job;
  const std::shared_ptr<EventLog> log = LogOf(job);
  log->AdvanceArchive(job.last_event, false);
  auto run = std::make_shared<JobRun>(
      *std::move(claimed), start.threads, log,
      [this](std::weak_ptr<JobRun> run_to_write) { writer_.Schedule(std::move(run_to_write)); });
  const std::lock_guard lock(mutex_);
  Active& active = active_[start.id];
  active.run = run;
  if (active.cancelled || job.state == JobState::kCancelling) run->Stop(StopCause::kCancelled);
  if (draining_) run->Stop(StopCause::kDrain);
  if (run->is_shard()) {
    interest_changed_ = true;  // others may end the ensemble
    house_.notify_one();
    return run;
  }
  if (const auto audience = watched_elsewhere_.find(start.id); audience != watched_elsewhere_.end()) {
    relay_.Want(start.id, log, audience->second.detail);
  }
  return run;
}

JobEnd JobManager::Solve(JobRun& run) {
  if (run.job().attempts > options_.max_attempts) {
    return {absl::InternalError(fmt::format("The job was started {} times without progress: each time its server, or "
                                            "the ranks, crashed or were killed.",
                                            options_.max_attempts)),
            ""};
  }
  for (milliseconds pause = kFirstPause; !run.stop().stop_requested(); WaitForStore(pause)) {
    JobEnd end;
    // CatchExceptions() logs an exception and returns a status for it.
    end.status = CatchExceptions(run.id(), [&]() -> absl::Status {
      end = solve_(run);
      return end.status;
    });
    if (!absl::IsUnavailable(end.status)) return end;
  }
  return {absl::CancelledError(), ""};
}

void JobManager::End(JobRun& run, const JobEnd& end) {
  if (run.is_shard() && end.status.ok()) {
    return Persist(run, [&] { return store_.FinishShard(run.lease(), end.shard); });
  }
  if (absl::IsAborted(end.status)) {
    return Persist(run, [&] { return run.Release(store_, true); });
  }
  JobState state = end.status.ok() ? JobState::kSucceeded : JobState::kFailed;
  absl::Status error = end.status;
  if (absl::IsCancelled(end.status)) {
    switch (run.cause()) {
      case StopCause::kNone:
        break;
      case StopCause::kCancelled:
        state = JobState::kCancelled;
        error = absl::OkStatus();
        break;
      case StopCause::kDeadline:
        error = absl::DeadlineExceededError(run.is_shard() ? kDeadlineOfEnsemble
                                                           : "The deadline passed while the job was running.");
        break;
      case StopCause::kDrain:
        return Persist(run, [&] { return run.Release(store_, false); });
      case StopCause::kLeaseLost:
        return Abandon(run);
    }
  }
  Persist(run, [&] { return run.Finish(store_, state, error, end.summary, end.tally); });
}

void JobManager::Abandon(JobRun& run) {
  if (!run.is_shard()) run.log()->Abandon();
}

void JobManager::Persist(JobRun& run, const std::function<absl::Status()>& write) {
  milliseconds pause = kFirstPause;
  for (;;) {
    const absl::Status status = write();
    if (status.ok()) return;
    {
      const std::lock_guard lock(mutex_);
      if (absl::IsAborted(status) || abandoning_) return Abandon(run);
    }
    WaitForStore(pause);
  }
}

void JobManager::WaitForStore(milliseconds& pause) {
  std::unique_lock lock(mutex_);
  work_.wait_for(lock, pause, [this] { return abandoning_; });
  pause = std::min(2 * pause, kLongestPause);
}

}  // namespace dlcs::jobs
