// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/job_watch.h"

#include <utility>
#include <vector>

namespace dlcs::jobs {
namespace {

constexpr int kPage = 256;

}  // namespace

JobWatch::JobWatch(JobStore& store, JobId id, std::shared_ptr<EventLog> log, const EventWatchOptions& options,
                   std::function<void()> ready)
    : store_(store), id_(std::move(id)), watch_(std::move(log), options, std::move(ready)) {}

EventWatch::Delivery JobWatch::Next() {
  EventWatch::Delivery delivery = watch_.Next();
  if (delivery.got == EventWatch::Got::kArchived) archived_through_ = delivery.archived_through;
  return delivery;
}

absl::Status JobWatch::Fetch() {
  absl::StatusOr<std::vector<Event>> events = store_.ReadEvents(id_, watch_.position(), kPage);
  if (!events.ok()) return events.status();
  if (events->empty()) {
    if (absl::Status status = store_.Get(std::nullopt, id_).status(); !status.ok()) return status;
  }
  const std::int64_t through = events->size() < kPage ? archived_through_ : events->back().sequence;
  watch_.Supply(*std::move(events), through);
  return absl::OkStatus();
}

}  // namespace dlcs::jobs
