// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/scheduler.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <queue>
#include <tuple>
#include <utility>

namespace dlcs::jobs {
namespace {

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

Duration FromSeconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

Duration RetryAfter(double seconds) { return FromSeconds(std::max(seconds, 0.1)); }

}  // namespace

std::optional<Refusal> Scheduler::Reserve(const Request& request) {
  std::optional<Refusal> refusal = Refuse(request);
  if (refusal.has_value()) return refusal;
  reserved_[request.id] = request;
  queued_core_seconds_ += request.demand.core_seconds;
  return std::nullopt;
}

void Scheduler::Confirm(const JobId& id) {
  const auto place = reserved_.extract(id);
  if (place.empty()) return;
  queued_core_seconds_ -= place.mapped().demand.core_seconds;
  Restore(place.mapped());
}

std::optional<Refusal> Scheduler::Enqueue(const Request& request) {
  std::optional<Refusal> refusal = Reserve(request);
  if (!refusal.has_value()) Confirm(request.id);
  return refusal;
}

void Scheduler::Restore(const Request& request) {
  Request capped = request;
  Demand& demand = capped.demand;
  const int cores = IsLarge(demand) ? limits_.cores - limits_.cores_kept_for_small : limits_.cores;
  demand.threads = std::clamp(demand.threads, 1, std::max(1, std::min(cores, limits_.max_threads_per_job)));
  Add(std::move(capped));
}

std::optional<Refusal> Scheduler::RefuseIfFull(const std::string& name) const {
  const auto owner = owners_.find(name);
  const auto kept =
      std::count_if(reserved_.begin(), reserved_.end(), [&](const auto& entry) { return entry.second.owner == name; });
  const auto of_owner =
      static_cast<double>(kept) + (owner == owners_.end() ? 0.0 : static_cast<double>(owner->second.queue.size()));
  // The time until a place is free: that of an average job.
  const double drain = queued_core_seconds_ / limits_.cores;
  const auto after_one = [drain](double jobs) { return RetryAfter(drain / std::max(jobs, 1.0)); };
  if (of_owner >= limits_.max_queued_jobs_per_user) {
    return Refusal{"max_queued_jobs_per_user", static_cast<double>(limits_.max_queued_jobs_per_user), of_owner + 1,
                   after_one(of_owner)};
  }
  if (queued() >= limits_.max_queued_jobs) {
    return Refusal{"max_queued_jobs", static_cast<double>(limits_.max_queued_jobs), queued() + 1.0,
                   after_one(queued())};
  }
  return std::nullopt;
}

std::optional<Refusal> Scheduler::Refuse(const Request& request) const {
  const Demand& demand = request.demand;
  if (demand.memory_bytes > std::min(limits_.max_job_memory_bytes, limits_.max_running_memory_bytes)) {
    return Refusal{"max_job_memory_bytes",
                   static_cast<double>(std::min(limits_.max_job_memory_bytes, limits_.max_running_memory_bytes)),
                   static_cast<double>(demand.memory_bytes), std::nullopt};
  }
  if (demand.core_seconds > limits_.max_job_core_seconds) {
    return Refusal{"max_job_core_seconds", limits_.max_job_core_seconds, demand.core_seconds, std::nullopt};
  }
  if (std::optional<Refusal> refusal = RefuseForDeadline(request)) return refusal;

  if (std::optional<Refusal> refusal = RefuseIfFull(request.owner)) return refusal;
  const double total = queued_core_seconds_ + demand.core_seconds;
  if (total > limits_.max_queued_core_seconds && queued() > 0) {
    return Refusal{"max_queued_core_seconds", limits_.max_queued_core_seconds, total,
                   RetryAfter((total - limits_.max_queued_core_seconds) / limits_.cores)};
  }
  return std::nullopt;
}

std::optional<Refusal> Scheduler::RefuseForDeadline(const Request& request) const {
  if (!request.deadline.has_value()) return std::nullopt;
  const double left = Seconds(*request.deadline - clock_.Now());
  const double run = RunSeconds(request.demand);
  const double wait = WaitSeconds(request);
  if (wait + run <= left) return std::nullopt;
  Refusal refusal{"deadline", left, wait + run, std::nullopt};
  // The same allowed time may be enough later, unless it is not enough even on an idle server.
  if (run <= left) refusal.retry_after = RetryAfter(wait);
  return refusal;
}

void Scheduler::Add(Request request) {
  const QueueKey key{.priority = request.priority, .arrival = ++arrivals_};
  queued_[request.id] = {.owner = request.owner, .key = key};
  queued_core_seconds_ += request.demand.core_seconds;
  if (request.deadline.has_value()) latest_starts_.emplace(LatestStart(request), request.id);
  Owner& owner = owners_[request.owner];
  if (owner.queue.empty()) owner.deficit = Savings(owner);
  owner.queued_core_seconds += request.demand.core_seconds;
  const bool is_aside = request.is_for_others;
  owner.queue[key] = {.request = std::move(request), .passed_over_since = std::nullopt, .is_aside = is_aside};
}

Scheduler::Request Scheduler::Take(const JobId& id) {
  const auto place = queued_.extract(id);
  Owner& owner = owners_[place.mapped().owner];
  Request request = std::move(owner.queue.extract(place.mapped().key).mapped().request);
  queued_core_seconds_ -= request.demand.core_seconds;
  if (request.deadline.has_value()) latest_starts_.erase({LatestStart(request), request.id});
  owner.queued_core_seconds -= request.demand.core_seconds;
  if (owner.queue.empty()) owner.idle_since = given_;
  return request;
}

Time Scheduler::LatestStart(const Request& request) {
  // The shards stored until then are kept, others may help with the rest, and predictions are on the safe side.
  if (request.takes_free_cores) return *request.deadline;
  return *request.deadline - FromSeconds(request.demand.core_seconds / request.demand.threads);
}

bool Scheduler::Remove(const JobId& id) {
  if (const auto place = reserved_.extract(id)) {
    queued_core_seconds_ -= place.mapped().demand.core_seconds;
    return true;
  }
  if (!queued_.contains(id)) return false;
  Take(id);
  return true;
}

std::vector<JobId> Scheduler::QueuedIds() const {
  std::vector<JobId> ids;
  for (const auto& [id, place] : queued_) ids.push_back(id);
  return ids;
}

bool Scheduler::FitsMemory(const Demand& demand) const {
  return running_.empty() || busy_memory_bytes_ + demand.memory_bytes <= limits_.max_running_memory_bytes;
}

int Scheduler::FreeCores(const Demand& demand) const {
  const int free = limits_.cores - busy_cores_;
  if (!IsLarge(demand)) return free;
  return std::min(free, std::max(1, limits_.cores - limits_.cores_kept_for_small) - busy_cores_of_large_);
}

bool Scheduler::Fits(const Request& request) const {
  return (request.takes_free_cores ? 1 : request.demand.threads) <= FreeCores(request.demand) &&
         FitsMemory(request.demand);
}

bool Scheduler::FitsInto(const Running& place, const Request& request) const {
  return !request.takes_free_cores && request.demand.threads <= place.request.demand.threads &&
         (IsLarge(place.request.demand) || !IsLarge(request.demand)) &&
         (running_.size() == 1 ||
          busy_memory_bytes_ - place.request.demand.memory_bytes + request.demand.memory_bytes <=
              limits_.max_running_memory_bytes);
}

double Scheduler::Savings(const Owner& owner) const {
  if (!owner.queue.empty()) return owner.deficit;
  // A user may accumulate as much as the others received at once when their jobs started, since it has to last until
  // those end. Not for large jobs, which leave cores to the others.
  double most = limits_.max_saved_core_seconds;
  for (const auto& [id, running] : running_) {
    const Demand& demand = running.request.demand;
    if (running.has_cores && !IsLarge(demand)) most = std::max(most, demand.core_seconds);
  }
  return std::min(owner.deficit + given_ - owner.idle_since, most);
}

bool Scheduler::MayBorrow(const Demand& demand, const Owner& owner, double savings) const {
  return demand.core_seconds <= std::min(limits_.small_core_seconds, savings) && owner.running == 0 &&
         burst_cores_in_use_ + demand.threads <= limits_.burst_cores && FitsMemory(demand);
}

std::optional<Scheduler::Choice> Scheduler::ChooseSmall() {
  std::optional<Choice> best;
  for (auto owner = owners_.begin(); owner != owners_.end(); ++owner) {
    auto& queue = owner->second.queue;
    const auto job = std::find_if(queue.begin(), queue.end(), [](const auto& entry) { return !entry.second.is_aside; });
    if (job == queue.end()) continue;
    const Demand& demand = job->second.request.demand;
    if (!MayBorrow(demand, owner->second, owner->second.deficit)) continue;
    const double missing = demand.core_seconds - owner->second.deficit;
    if (!best.has_value() || missing < best->missing) best = Choice{owner, job, missing};
  }
  return best;
}

std::optional<Scheduler::Choice> Scheduler::Choose(bool only_fitting) {
  std::optional<Choice> best;
  const auto consider = [&](std::map<std::string, Owner>::iterator owner) {
    auto& queue = owner->second.queue;
    const auto job = std::find_if(queue.begin(), queue.end(), [&](const auto& entry) {
      return !entry.second.is_aside && (!only_fitting || Fits(entry.second.request));
    });
    if (job == queue.end()) return;
    const double missing = job->second.request.demand.core_seconds - owner->second.deficit;
    if (!best.has_value() || missing < best->missing) best = Choice{owner, job, missing};
  };
  // Of equal ones, the next in round-robin order.
  const auto begin = owners_.upper_bound(turn_);
  for (auto owner = begin; owner != owners_.end(); ++owner) consider(owner);
  for (auto owner = owners_.begin(); owner != begin; ++owner) consider(owner);
  return best;
}

std::optional<Scheduler::Start> Scheduler::StartNext() {
  const std::optional<Choice> turn = Choose(false);
  if (!turn.has_value()) {
    if (running_.empty() && queued_.empty()) owners_.clear();  // no other user to compare with
    return std::nullopt;
  }
  const Demand& demand = turn->job->second.request.demand;
  if (Fits(turn->job->second.request)) return Begin(*turn);
  if (busy_cores_ < limits_.cores) {
    const Duration now = clock_.Elapsed();
    std::optional<Duration>& since = turn->job->second.passed_over_since;
    if (!since.has_value()) since = now;
    const bool is_patient = now - *since <= limits_.max_skip_time;
    if (const std::optional<Choice> other = is_patient ? Choose(true) : std::nullopt) return Begin(*other);
    // Additional threads do not use up cores, but memory is limited.
    if (!is_patient && !FitsMemory(demand)) return std::nullopt;
  }
  const std::optional<Choice> small = ChooseSmall();
  if (!small.has_value()) return std::nullopt;
  return Begin(*small, true);
}

Scheduler::Start Scheduler::Begin(const Choice& choice, bool on_burst_cores) {
  const double gift = std::max(0.0, choice.missing);
  given_ += gift;
  for (auto& [name, owner] : owners_) {
    if (owner.queue.empty()) continue;
    // A user whose job is passed over because of memory or cores accumulates no more than that job costs.
    const double most = std::max(owner.deficit, owner.queue.begin()->second.request.demand.core_seconds);
    owner.deficit = name == choice.owner->first ? owner.deficit + gift : std::min(owner.deficit + gift, most);
  }
  choice.owner->second.deficit -= choice.job->second.request.demand.core_seconds;
  turn_ = choice.owner->first;

  ++choice.owner->second.running;
  Request request = Take(JobId(choice.job->second.request.id));
  if (request.takes_free_cores && !on_burst_cores) {
    request.demand.threads = std::min(request.demand.threads, FreeCores(request.demand));
  }
  (on_burst_cores ? burst_cores_in_use_ : busy_cores_) += request.demand.threads;
  if (IsLarge(request.demand)) busy_cores_of_large_ += request.demand.threads;
  busy_memory_bytes_ += request.demand.memory_bytes;
  const Start start{.id = request.id, .threads = request.demand.threads};
  running_[start.id] = {.request = std::move(request), .since = clock_.Elapsed(), .on_burst_cores = on_burst_cores};
  return start;
}

std::vector<JobId> Scheduler::SetAside(const JobId& started, int most) {
  Running& place = running_.at(started);
  if (place.on_burst_cores || place.request.takes_free_cores) return {};
  // The next job of each user, and the credit that the user then lacks: the least is next. Of equal ones, the user
  // whose turn it is, as if `started` had not been there, and those behind.
  struct Next {
    double missing = 0;
    std::size_t turn = 0;
    std::map<QueueKey, Queued>* queue = nullptr;
    std::map<QueueKey, Queued>::iterator job;
    bool operator>(const Next& other) const { return std::tie(missing, turn) > std::tie(other.missing, other.turn); }
  };
  std::priority_queue<Next, std::vector<Next>, std::greater<>> next;
  const auto add = [&](Next user) {
    user.job = std::find_if(user.job, user.queue->end(), [&](const auto& entry) {
      return !entry.second.is_aside && FitsInto(place, entry.second.request);
    });
    if (user.job == user.queue->end()) return;
    user.missing += user.job->second.request.demand.core_seconds;
    next.push(user);
  };
  const auto add_user = [&](auto& entry) {
    auto& [name, owner] = entry;
    const double returned = name == place.request.owner ? place.request.demand.core_seconds : 0;
    add({.missing = -owner.deficit - returned, .turn = next.size(), .queue = &owner.queue, .job = owner.queue.begin()});
  };
  const auto begin = owners_.lower_bound(place.request.owner);
  std::for_each(begin, owners_.end(), add_user);
  std::for_each(owners_.begin(), begin, add_user);
  const auto count = std::min(static_cast<std::size_t>(most), queued_.size() / 2);
  while (place.aside.size() < count && !next.empty()) {
    Next user = next.top();
    next.pop();
    user.job->second.is_aside = true;
    place.aside.push_back(user.job->second.request.id);
    ++user.job;
    add(user);
  }
  return place.aside;
}

void Scheduler::PutBack(const JobId& started) {
  for (const JobId& id : std::exchange(running_.at(started).aside, {})) {
    const auto place = queued_.find(id);  // it may have been removed
    if (place != queued_.end()) owners_[place->second.owner].queue.at(place->second.key).is_aside = false;
  }
}

std::optional<Scheduler::Start> Scheduler::Settle(const JobId& started, const std::optional<Request>& claimed) {
  Running& place = running_.at(started);
  if (!claimed.has_value() || claimed->id != started) {
    for (const JobId& id : place.aside) {
      if (claimed.has_value() && claimed->id == id) break;
      if (queued_.contains(id)) Take(id);
    }
  }
  PutBack(started);
  if (claimed.has_value() && claimed->id == started) {
    return Start{.id = started, .threads = place.request.demand.threads};
  }
  if (!claimed.has_value()) return std::nullopt;
  Finished(started, 0);
  if (!queued_.contains(claimed->id)) Restore(*claimed);
  const Place& other = queued_.at(claimed->id);
  const auto owner = owners_.find(other.owner);
  const auto job = owner->second.queue.find(other.key);
  return Begin({owner, job, job->second.request.demand.core_seconds - owner->second.deficit});
}

void Scheduler::GiveBackCores(const JobId& id, double core_seconds) {
  const auto found = running_.find(id);
  if (found == running_.end() || !std::exchange(found->second.has_cores, false)) return;
  const Request& request = found->second.request;
  (found->second.on_burst_cores ? burst_cores_in_use_ : busy_cores_) -= request.demand.threads;
  if (IsLarge(request.demand)) busy_cores_of_large_ -= request.demand.threads;
  Owner& owner = owners_[request.owner];
  owner.deficit += request.demand.core_seconds - core_seconds;
  --owner.running;
}

void Scheduler::Finished(const JobId& id, double core_seconds) {
  GiveBackCores(id, core_seconds);
  const auto ended = running_.extract(id);
  if (!ended.empty()) busy_memory_bytes_ -= ended.mapped().request.demand.memory_bytes;
}

std::vector<JobId> Scheduler::TakeUnmeetable() {
  std::vector<JobId> unmeetable;
  while (!latest_starts_.empty() && latest_starts_.begin()->first < clock_.Now()) {
    unmeetable.push_back(latest_starts_.begin()->second);
    Remove(JobId(unmeetable.back()));
  }
  return unmeetable;
}

double Scheduler::RunningCoreSeconds() const {
  double rest = 0;
  for (const auto& [id, running] : running_) {
    if (!running.has_cores) continue;
    const Demand& demand = running.request.demand;
    rest += std::max(0.0, demand.core_seconds - Seconds(clock_.Elapsed() - running.since) * demand.threads);
  }
  return rest;
}

double Scheduler::WaitSeconds(const Request& request) const {
  if (queued_.empty() && Fits(request)) return 0;
  double ahead = 0;
  static const Owner kStranger;
  const auto found = owners_.find(request.owner);
  const Owner& own = found == owners_.end() ? kStranger : found->second;
  if (own.queue.empty() && MayBorrow(request.demand, own, Savings(own))) return 0;
  for (const auto& [key, queued] : own.queue) {
    if (key.priority >= request.priority) ahead += queued.request.demand.core_seconds;
  }
  // While this user receives this much, each of the others gets at most the same.
  double total = RunningCoreSeconds() + ahead;
  for (const auto& [name, owner] : owners_) {
    if (name != request.owner) total += std::min(owner.queued_core_seconds, ahead + request.demand.core_seconds);
  }
  return total / limits_.cores;
}

}  // namespace dlcs::jobs
