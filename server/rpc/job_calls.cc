// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/job_calls.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/access/credentials.h"
#include "server/solve_jobs/convert_job.h"
#include "server/solve_jobs/job_limits.h"
#include "server/solve_jobs/resource_names.h"

namespace dlcs {
namespace {

jobs::Duration IntervalOf(const google::protobuf::Duration& interval) {
  constexpr std::int64_t kMaxSeconds = kMaxWatchInterval.count();
  return std::chrono::seconds(std::clamp<std::int64_t>(interval.seconds(), 0, kMaxSeconds)) +
         std::chrono::microseconds(std::max(interval.nanos(), 0) / 1000);
}

}  // namespace

// Events.

absl::Status JobWatchCall::Work() {
  if (watch_) return watch_->Fetch();
  const absl::StatusOr<Caller> caller = CallerOf(environment_.access, context_);
  if (!caller.ok()) return caller.status();
  absl::StatusOr<UserQuota::Ticket> place = environment_.watches.Take(caller->user);
  if (!place.ok()) return place.status();
  place_ = *std::move(place);
  const absl::StatusOr<jobs::JobId> id = JobIdOf(request_.name());
  if (!id.ok()) return id.status();
  absl::StatusOr<WatchView> view = WatchView::Create(request_);
  if (!view.ok()) return view.status();
  view_ = *std::move(view);
  jobs::EventWatchOptions options;
  options.after = request_.after_sequence();
  options.durable_only = view_.wants_progress_only();
  options.detail = view_.detail();
  options.min_interval = IntervalOf(request_.min_interval());
  auto watch = environment_.jobs->manager().Watch(caller->SeesJobsOf(), *id, options, Waker());
  if (!watch.ok()) return watch.status();
  watch_ = *std::move(watch);
  return absl::OkStatus();
}

absl::StatusOr<JobWatchCall::Got> JobWatchCall::Next(v1::SolveEvent& event) {
  if (behind_gap_) return ToMessage(*std::exchange(behind_gap_, std::nullopt), event);
  jobs::EventWatch::Delivery delivery = watch_->Next();
  switch (delivery.got) {
    case jobs::EventWatch::Got::kEvent:
      if (!delivery.gap) return ToMessage(delivery.event, event);
      behind_gap_ = std::move(delivery.event);
      event = ToProto(*delivery.gap, jobs::SystemClock().Now());
      return Got::kMessage;
    case jobs::EventWatch::Got::kHeartbeat:
      event = HeartbeatAfter(watch_->position(), jobs::SystemClock().Now());
      return Got::kMessage;
    case jobs::EventWatch::Got::kNothing:
      return Got::kNothing;
    case jobs::EventWatch::Got::kArchived:
      return Got::kBlocks;
    case jobs::EventWatch::Got::kEnd:
      break;
  }
  return Got::kEnd;
}

absl::StatusOr<JobWatchCall::Got> JobWatchCall::ToMessage(const jobs::Event& delivered, v1::SolveEvent& event) const {
  event = ToProto(delivered);
  if (event.has_iterate()) view_.Narrow(*event.mutable_iterate());
  if (event.has_analysis()) {
    if (absl::Status admitted = view_.Admits(event.analysis()); !admitted.ok()) return admitted;
  }
  return Got::kMessage;
}

// The trajectory.

absl::Status ReadTrajectoryCall::Work() {
  if (!reader_) {
    const absl::StatusOr<jobs::JobId> id = JobIdOf(request_.name());
    if (!id.ok()) return id.status();
    const absl::StatusOr<Caller> caller = CallerOf(environment_.access, context_);
    if (!caller.ok()) return caller.status();
    absl::StatusOr<TrajectoryReader> reader =
        TrajectoryReader::Create(environment_.jobs->manager().store(), caller->SeesJobsOf(), *id, request_);
    if (!reader.ok()) return reader.status();
    reader_ = *std::move(reader);
  }
  absl::StatusOr<std::optional<v1::TrajectoryPage>> page = reader_->Next();
  if (!page.ok()) return page.status();
  page_ = *std::move(page);
  ended_ = !page_.has_value();
  return absl::OkStatus();
}

absl::StatusOr<ReadTrajectoryCall::Got> ReadTrajectoryCall::Next(v1::TrajectoryPage& page) {
  if (ended_) return Got::kEnd;
  if (!page_) return Got::kBlocks;
  page = *std::move(page_);
  page_.reset();
  return Got::kMessage;
}

// The results of an ensemble.

absl::Status ReadEnsembleCall::Open() {
  const absl::StatusOr<jobs::JobId> id = JobIdOf(request_.name());
  if (!id.ok()) return id.status();
  const absl::StatusOr<Caller> caller = CallerOf(environment_.access, context_);
  if (!caller.ok()) return caller.status();
  jobs::JobManager& manager = environment_.jobs->manager();
  absl::StatusOr<EnsembleReader> reader = EnsembleReader::Create(manager.store(), caller->SeesJobsOf(), *id, request_);
  if (!reader.ok()) return reader.status();
  reader_ = *std::move(reader);
  if (!request_.follow()) return absl::OkStatus();
  absl::StatusOr<UserQuota::Ticket> place = environment_.watches.Take(caller->user);
  if (!place.ok()) return place.status();
  place_ = *std::move(place);
  // Before the first read, so that no shard is stored unnoticed in between.
  const absl::StatusOr<jobs::Job> job = manager.store().Get(caller->SeesJobsOf(), *id);
  if (!job.ok()) return job.status();
  jobs::EventWatchOptions options;
  options.after = job->last_event;
  options.durable_only = true;
  auto watch = manager.Watch(caller->SeesJobsOf(), *id, options, Waker());
  if (!watch.ok()) return watch.status();
  watch_ = *std::move(watch);
  return absl::OkStatus();
}

absl::Status ReadEnsembleCall::Work() {
  if (!reader_) {
    if (absl::Status opened = Open(); !opened.ok()) return opened;
  }
  if (std::exchange(fetches_, false)) return watch_->Fetch();
  absl::StatusOr<std::optional<v1::EnsemblePage>> page = reader_->Next();
  if (!page.ok()) return page.status();
  page_ = *std::move(page);
  waits_ = !page_.has_value();
  return absl::OkStatus();
}

absl::StatusOr<ReadEnsembleCall::Got> ReadEnsembleCall::Next(v1::EnsemblePage& page) {
  if (ended_) return Got::kEnd;
  if (page_) {
    page = *std::move(page_);
    page_.reset();
    ended_ = page.complete();
    return Got::kMessage;
  }
  if (!waits_) return Got::kBlocks;
  if (watch_ == nullptr) return Got::kEnd;
  return Wait(page);
}

ReadEnsembleCall::Got ReadEnsembleCall::Wait(v1::EnsemblePage& page) {
  switch (watch_->Next().got) {
    case jobs::EventWatch::Got::kArchived:
      fetches_ = true;
      return Got::kBlocks;
    case jobs::EventWatch::Got::kHeartbeat:
      page = reader_->EmptyPage();
      return Got::kMessage;
    case jobs::EventWatch::Got::kNothing:
      return Got::kNothing;
    case jobs::EventWatch::Got::kEvent:
    case jobs::EventWatch::Got::kEnd:
      break;
  }
  waits_ = false;
  return Got::kBlocks;
}

}  // namespace dlcs
