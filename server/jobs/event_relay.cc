// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/event_relay.h"

#include <iterator>
#include <utility>

namespace dlcs::jobs {

EventRelay::EventRelay(JobStore& store, const Clock& clock)
    : store_(store), clock_(clock), thread_([this] { Work(); }) {}

EventRelay::~EventRelay() {
  {
    const std::lock_guard lock(bell_->mutex);
    bell_->ending = true;
  }
  bell_->rung.notify_one();
  thread_.join();
}

void EventRelay::Want(const JobId& id, std::shared_ptr<EventLog> log, const EventDetail& detail) {
  {
    const std::lock_guard lock(bell_->mutex);
    bell_->wanted.push_back({id, std::move(log), detail});
    bell_->rings = true;
  }
  bell_->rung.notify_one();
}

void EventRelay::Work() {
  for (;;) {
    std::vector<Wanted> wanted;
    {
      std::unique_lock lock(bell_->mutex);
      bell_->rung.wait_for(lock, kFor, [this] { return bell_->rings || bell_->ending; });
      if (bell_->ending) return;
      bell_->rings = false;
      wanted.swap(bell_->wanted);
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
  relayed.watch = std::make_unique<EventWatch>(std::move(wanted.log), options, [bell = bell_] {
    {
      const std::lock_guard lock(bell->mutex);
      bell->rings = true;
    }
    bell->rung.notify_one();
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
