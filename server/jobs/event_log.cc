// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/event_log.h"

#include <algorithm>
#include <utility>

namespace dlcs::jobs {
namespace {

constexpr std::int64_t kReservationBlock = 4096;

std::size_t SizeOf(const Event& event) { return event.payload->size() + kEventOverheadBytes; }

// The first event with a number above `sequence`.
std::deque<Event>::const_iterator After(const std::deque<Event>& events, std::int64_t sequence) {
  return std::upper_bound(events.begin(), events.end(), sequence,
                          [](std::int64_t number, const Event& event) { return number < event.sequence; });
}

}  // namespace

EventLog::EventLog(const EventLogLimits& limits, const Clock& clock, EventWaker* waker, std::int64_t archived_through)
    : limits_(limits), clock_(clock), waker_(waker) {
  AdvanceArchive(archived_through, false);
}

Event EventLog::Append(EventKind kind, std::string payload) {
  // Memory is allocated, and the time read, before the mutex is locked.
  Event event{.sequence = 0,
              .time = clock_.Now(),
              .kind = kind,
              .payload = std::make_shared<const std::string>(std::move(payload))};
  bool wake = false;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return event;
    closed_ = kind == EventKind::kSummary;
    event.sequence = ++last_;
    bytes_ += SizeOf(event);
    (IsDurable(kind) ? durable_ : transient_).push_back(event);
    if (OverLimits()) Evict();
    wake = VisibleThrough() >= event.sequence && (IsDurable(kind) ? NeedsWake() : NeedsWakeForTransient());
  }
  WakeIf(wake);
  return event;
}

void EventLog::MarkStored(std::int64_t through) {
  bool wake = false;
  {
    const std::lock_guard lock(mutex_);
    stored_ = std::max(stored_, through);
    if (OverLimits()) Evict();
    wake = NeedsWake();
  }
  WakeIf(wake);
}

void EventLog::Reserve(std::int64_t through) {
  bool wake = false;
  {
    const std::lock_guard lock(mutex_);
    reserved_ = std::max(reserved_, through);
    wake = NeedsWake();
  }
  WakeIf(wake);
}

std::int64_t EventLog::WantedReservation() const {
  const std::lock_guard lock(mutex_);
  // A block in proportion to the numbers used so far: O(log events) writes to the store.
  const std::int64_t block = std::max(kReservationBlock, last_ - first_);
  return reserved_ - last_ >= block / 2 ? 0 : last_ + block;
}

void EventLog::AdvanceArchive(std::int64_t through, bool closed) {
  bool wake = false;
  {
    const std::lock_guard lock(mutex_);
    if (closed_ || through < last_ || (through == last_ && !closed)) return;
    closed_ = closed;
    RestartAfter(through);
    wake = NeedsWake();
  }
  WakeIf(wake);
}

void EventLog::AppendRelayed(Event event, std::int64_t durable_before) {
  bool wake = false;
  {
    const std::lock_guard lock(mutex_);
    if (closed_ || event.sequence <= last_) return;
    if (durable_before > archived_) RestartAfter(std::max(durable_before, last_));
    last_ = event.sequence;
    reserved_ = std::max(reserved_, last_);
    forgotten_ = last_ - 1;  // those in between were not relayed
    bytes_ += SizeOf(event);
    transient_.push_back(std::move(event));
    if (OverLimits()) Evict();
    wake = NeedsWake();
  }
  WakeIf(wake);
}

void EventLog::Abandon() {
  const std::lock_guard lock(mutex_);
  closed_ = false;
  RestartAfter(VisibleThrough());
}

void EventLog::RestartAfter(std::int64_t sequence) {
  last_ = sequence;
  reserved_ = std::max(reserved_, last_);
  stored_ = archived_ = forgotten_ = first_ = last_;
  transient_.clear();
  durable_.clear();
  bytes_ = 0;
}

std::int64_t EventLog::last_sequence() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

bool EventLog::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::size_t EventLog::num_events() const {
  const std::lock_guard lock(mutex_);
  return transient_.size() + durable_.size();
}

std::size_t EventLog::num_bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::shared_ptr<const EventDetail> EventLog::WantedDetail() const {
  const std::lock_guard lock(mutex_);
  return wanted_detail_;
}

bool EventLog::HasFullWatchers() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(watches_, [](const EventWatch* watch) { return !watch->options_.durable_only; });
}

void EventLog::GatherDetail() {
  EventDetail wanted;
  for (const EventWatch* watch : watches_) wanted = Union(wanted, watch->options_.detail);
  if (wanted != *wanted_detail_) wanted_detail_ = std::make_shared<const EventDetail>(std::move(wanted));
}

Duration EventLog::TakeReady(std::vector<std::shared_ptr<const std::function<void()>>>& ready) {
  const Duration now = clock_.Elapsed();
  const std::lock_guard lock(mutex_);
  woken_ = false;
  next_due_ = Duration::max();
  for (EventWatch* watch : watches_) {
    if (!watch->waiting_) continue;
    const Choice choice = Choose(*watch, now);
    if (choice.what == Choice::What::kWait) {
      watch->due_ = choice.due;
      next_due_ = std::min(next_due_, choice.due);
    } else {
      watch->waiting_ = false;
      ready.push_back(watch->ready_);
    }
  }
  return next_due_;
}

EventLog::Choice EventLog::Choose(const EventWatch& watch, Duration now) const {
  using What = Choice::What;
  if (watch.ended_) return {What::kEnd};
  if (!watch.supplied_.empty()) return {What::kSupplied, &watch.supplied_.front()};
  if (std::max(watch.position_, watch.supplied_through_) < archived_) return {What::kArchived};
  if (closed_ && watch.position_ >= last_) return {What::kEnd};
  Choice choice = ChooseFromMemory(watch, now);
  if (choice.what != What::kWait) return choice;
  const Duration heartbeat_due = watch.last_delivery_ + watch.options_.heartbeat;
  if (now >= heartbeat_due) return {What::kHeartbeat};
  choice.due = std::min(choice.due, heartbeat_due);
  return choice;
}

EventLog::Choice EventLog::ChooseFromMemory(const EventWatch& watch, Duration now) const {
  using What = Choice::What;
  const std::int64_t visible = VisibleThrough();
  const auto durable = After(durable_, watch.position_);
  const bool has_durable = durable != durable_.end() && durable->sequence <= visible;
  // The run of transient events before the next durable one.
  const auto first = After(transient_, watch.position_);
  const auto last = After(transient_, has_durable ? durable->sequence : visible);
  if (first < last && !watch.options_.durable_only) {
    const bool throttled = watch.options_.min_interval > Duration::zero();
    if (!throttled || now >= watch.next_transient_) {
      const bool newest_only = throttled || static_cast<std::size_t>(last - first) > watch.options_.max_backlog;
      return {What::kTransient, newest_only ? &*std::prev(last) : &*first};
    }
    // Too early for this run; the next durable event supersedes it.
    if (!has_durable) return {What::kWait, nullptr, watch.next_transient_};
  }
  if (has_durable) return {What::kDurable, &*durable};
  return {What::kWait};
}

std::int64_t EventLog::VisibleThrough() const {
  const auto on_its_way = After(durable_, stored_);
  const std::int64_t settled = on_its_way == durable_.end() ? last_ : on_its_way->sequence - 1;
  return std::min(settled, reserved_);
}

bool EventLog::OverLimits() const {
  return transient_.size() + durable_.size() > limits_.max_events || bytes_ > limits_.max_bytes;
}

void EventLog::Evict() {
  while (OverLimits() && transient_.size() > 1) {
    bytes_ -= SizeOf(transient_.front());
    forgotten_ = transient_.front().sequence;
    transient_.pop_front();
  }
  // Durable events are evicted last and only if they are stored, so that all events up to archived_ are in the store.
  if (!OverLimits() || durable_.empty() || durable_.front().sequence > stored_) return;
  while (OverLimits() && !durable_.empty() && durable_.front().sequence <= stored_) {
    bytes_ -= SizeOf(durable_.front());
    archived_ = durable_.front().sequence;
    durable_.pop_front();
  }
  while (!transient_.empty() && transient_.front().sequence < archived_) {
    bytes_ -= SizeOf(transient_.front());
    forgotten_ = transient_.front().sequence;
    transient_.pop_front();
  }
}

bool EventLog::NeedsWake() {
  if (waker_ == nullptr || woken_) return false;
  woken_ = std::any_of(watches_.begin(), watches_.end(), [](const EventWatch* watch) { return watch->waiting_; });
  return woken_;
}

// A thousand iterates per second must not wake a watcher that wants twenty per second a thousand times.
bool EventLog::NeedsWakeForTransient() {
  if (waker_ == nullptr || woken_) return false;
  woken_ = std::any_of(watches_.begin(), watches_.end(), [](const EventWatch* watch) {
    const bool will_be_woken_in_time = watch->due_ <= watch->next_transient_;
    return watch->waiting_ && !watch->options_.durable_only && !will_be_woken_in_time;
  });
  return woken_;
}

void EventLog::WakeIf(bool needed) {
  if (needed) waker_->Wake(shared_from_this());
}

EventWatch::EventWatch(std::shared_ptr<EventLog> log, const EventWatchOptions& options, std::function<void()> ready)
    : log_(std::move(log)),
      options_([&options] {
        EventWatchOptions cut = options;
        cut.heartbeat = std::min(cut.heartbeat, EventWatchOptions::kMaxHeartbeat);
        return cut;
      }()),
      ready_(std::make_shared<const std::function<void()>>(std::move(ready))),
      position_(options.after),
      last_delivery_(log_->clock_.Elapsed()) {
  const std::lock_guard lock(log_->mutex_);
  log_->watches_.push_back(this);
  log_->GatherDetail();
}

EventWatch::~EventWatch() {
  const std::lock_guard lock(log_->mutex_);
  std::erase(log_->watches_, this);
  log_->GatherDetail();
}

EventWatch::Delivery EventWatch::Next() {
  using What = EventLog::Choice::What;
  const Duration now = log_->clock_.Elapsed();
  bool wake = false;
  Delivery delivery;
  {
    const std::lock_guard lock(log_->mutex_);
    waiting_ = false;
    const EventLog::Choice choice = log_->Choose(*this, now);
    switch (choice.what) {
      case What::kSupplied: {
        Event event = std::move(supplied_.front());
        supplied_.pop_front();
        delivery = Deliver(std::move(event), now);
        break;
      }
      case What::kTransient:
        next_transient_ = now + options_.min_interval;
        [[fallthrough]];
      case What::kDurable:
        delivery = Deliver(*choice.event, now);
        break;
      case What::kArchived:
        delivery.got = Got::kArchived;
        delivery.archived_through = log_->archived_;
        break;
      case What::kHeartbeat:
        last_delivery_ = now;
        delivery.got = Got::kHeartbeat;
        break;
      case What::kEnd:
        delivery.got = Got::kEnd;
        break;
      case What::kWait:
        waiting_ = true;
        due_ = choice.due;
        // The waker sleeps until the earliest time that it was given.
        wake = due_ < log_->next_due_ && log_->NeedsWake();
        break;
    }
  }
  log_->WakeIf(wake);
  return delivery;
}

bool EventWatch::has_more() const {
  using What = EventLog::Choice::What;
  const Duration now = log_->clock_.Elapsed();
  const std::lock_guard lock(log_->mutex_);
  const What what = log_->Choose(*this, now).what;
  return what == What::kSupplied || what == What::kTransient || what == What::kDurable;
}

EventWatch::Delivery EventWatch::Deliver(Event event, Duration now) {
  Delivery delivery{.got = Got::kEvent, .gap = std::nullopt, .event = {}, .archived_through = 0};
  if (event.sequence > position_ + 1 && !options_.durable_only) {
    EventGap gap{.first = position_ + 1, .last = event.sequence - 1, .why = EventGap::Why::kSlow};
    if (gap.first <= std::max(log_->first_, log_->forgotten_)) {
      gap.why = EventGap::Why::kNotRetained;
    } else if (options_.min_interval > Duration::zero()) {
      gap.why = EventGap::Why::kInterval;
    }
    delivery.gap = gap;
  }
  position_ = event.sequence;
  last_delivery_ = now;
  ended_ = event.kind == EventKind::kSummary;
  delivery.event = std::move(event);
  return delivery;
}

void EventWatch::Supply(std::vector<Event> events, std::int64_t through) {
  const std::lock_guard lock(log_->mutex_);
  // Events that are also in memory are delivered from there, with the transient events between them.
  const std::int64_t archived = log_->archived_;
  for (Event& event : events) {
    if (event.sequence > position_ && event.sequence <= archived) supplied_.push_back(std::move(event));
  }
  supplied_through_ = std::max(supplied_through_, std::min(through, archived));
}

}  // namespace dlcs::jobs
