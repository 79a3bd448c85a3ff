// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/event_relay.h"

#include <iterator>
#include <utility>

namespace dlcs::jobs {

EventRelay::EventRelay(JobStore& store, const Clock& clock)
    : store_(store), clock_(clock), thread_([this] { Work(); }) {}

EventRelay::~EventRelay() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->ending = true;
  }
  shared_->changed.notify_one();
  thread_.join();
}

void EventRelay::Want(const JobId& id, std::shared_ptr<EventLog> log, const EventDetail& detail) {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->wanted.push_back({id, std::move(log), detail});
    shared_->has_work = true;
  }
  shared_->changed.notify_one();
}

void EventRelay::Work() {
  for (;;) {
    std::vector<Wanted> wanted;
    {
      std::unique_lock lock(shared_->mutex);
      shared_->changed.wait_for(lock, kFor, [this] { return shared_->has_work || shared_->ending; });
      if (shared_->ending) return;
      shared_->has_work = false;
      wanted.swap(shared_->wanted);
    }
    for (Wanted& one : wanted) Begin(std::move(one));
    for (auto one = relayed_.begin(); one != relayed_.end();) {
      const bool continues = clock_.Elapsed() < one->second.until && PassOn(one->first, one->second);
      one = continues ? std::next(one) : relayed_.erase(one);
    }
  }
}

void EventRelay::Begin(Wanted wanted) {
  Relayed& relayed = relayed_[wanted.id];
  relayed.until = clock_.Elapsed() + kFor;
  const EventDetail detail = Union(relayed.detail, wanted.detail);
  if (relayed.watch != nullptr && detail == relayed.detail) return;
  relayed.detail = detail;
  relayed.durable_through = relayed.watch ? relayed.watch->position() : wanted.log->last_sequence();
  const EventWatchOptions options{.after = relayed.durable_through, .detail = detail, .min_interval = kInterval};
  relayed.watch = std::make_unique<EventWatch>(std::move(wanted.log), options, [shared = shared_] {
    {
      const std::lock_guard lock(shared->mutex);
      shared->has_work = true;
    }
    shared->changed.notify_one();
  });
}

bool EventRelay::PassOn(const JobId& id, Relayed& relayed) {
  for (;;) {
    EventWatch::Delivery delivery = relayed.watch->Next();
    switch (delivery.got) {
      case EventWatch::Got::kEvent:
        if (IsDurable(delivery.event.kind)) {
          relayed.durable_through = delivery.event.sequence;
        } else {
          store_.Publish({.what = JobChange::What::kTransient,
                          .job = id,
                          .detail = {},
                          .event = std::move(delivery.event),
                          .durable_before = relayed.durable_through});
        }
        break;
      case EventWatch::Got::kArchived:
        // Watchers that receive the next event read these from the store.
        relayed.durable_through = delivery.archived_through;
        relayed.watch->Supply({}, delivery.archived_through);
        break;
      case EventWatch::Got::kHeartbeat:
        break;
      case EventWatch::Got::kNothing:
        return true;
      case EventWatch::Got::kEnd:
        return false;
    }
  }
}

}  // namespace dlcs::jobs
