// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/job_calls.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/jobs/catch_exceptions.h"
#include "server/solve_jobs/convert_job.h"
#include "server/solve_jobs/job_limits.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"

namespace dlcs {
namespace {

jobs::Duration IntervalOf(const google::protobuf::Duration& interval) {
  constexpr std::int64_t kMostSeconds = kMaxWatchInterval.count();
  return std::chrono::seconds(std::clamp<std::int64_t>(interval.seconds(), 0, kMostSeconds)) +
         std::chrono::microseconds(std::max(interval.nanos(), 0) / 1000);
}

}  // namespace

// One answer.

grpc::ServerUnaryReactor* JobCall::Start(const JobCallEnvironment& environment, const char* name, Work work) {
  const auto call = std::make_shared<JobCall>(name, std::move(work));
  call->self_ = call;
  call->control_ = environment.calls.Register();
  if (call->control_ == nullptr) {
    call->Finish(ToGrpc(ShuttingDown()));
  } else {
    environment.workers.Run([call] {
      const absl::Status done = CatchExceptions(call->name_, call->work_);
      call->Finish(ToGrpc(done));
    });
  }
  return call.get();
}

void JobCall::OnDone() {
  // May be the last share: moved out first, so that nobody destroys the pointer that is being reset.
  const std::shared_ptr<JobCall> self = std::move(self_);
}

// Many answers.

template <typename Message>
grpc::ServerWriteReactor<Message>* JobStream<Message>::Begin(std::shared_ptr<JobStream> call) {
  call->self_ = call;
  call->control_ = call->environment_.calls.Register();
  if (call->control_ == nullptr) {
    call->finished_ = true;
    call->Finish(ToGrpc(ShuttingDown()));
  } else {
    // The first message follows when the headers are sent: before, gRPC has not taken the reactor over.
    call->StartSendInitialMetadata();
  }
  return call.get();
}

template <typename Message>
void JobStream<Message>::OnSendInitialMetadataDone(bool ok) {
  if (!ok) HangUp(absl::CancelledError());
  const std::weak_ptr<JobStream> weak = this->weak_from_this();
  // Not at once: whoever stops all calls holds the lock that the end of this one needs.
  on_stop_.emplace(control_->token(), [weak, &workers = environment_.workers] {
    workers.Run([weak] {
      if (const auto call = weak.lock()) call->HangUp(ShuttingDown());
    });
  });
  PrepareOnWorker();
}

template <typename Message>
void JobStream<Message>::PrepareOnWorker() {
  environment_.workers.Run([self = this->shared_from_this()] {
    const absl::Status prepared = CatchExceptions("job stream", [&] { return self->Prepare(); });
    {
      const std::lock_guard lock(self->mutex_);
      self->busy_ = false;
      if (!prepared.ok() && !self->hung_up_) self->hung_up_ = prepared;
    }
    self->Pump();
  });
}

template <typename Message>
void JobStream<Message>::Pump() {
  const std::lock_guard lock(mutex_);
  if (busy_ || finished_) return;
  if (hung_up_) {
    finished_ = true;
    return this->Finish(ToGrpc(*hung_up_));
  }
  const absl::StatusOr<Got> got = Next(message_);
  if (!got.ok()) {
    finished_ = true;
    return this->Finish(ToGrpc(got.status()));
  }
  switch (*got) {
    case Got::kMessage:
      busy_ = true;
      return this->StartWrite(&message_);
    case Got::kNothing:
      return;
    case Got::kBlocks:
      busy_ = true;
      return PrepareOnWorker();
    case Got::kEnd:
      finished_ = true;
      return this->Finish(grpc::Status::OK);
  }
}

template <typename Message>
void JobStream<Message>::OnWriteDone(bool ok) {
  {
    const std::lock_guard lock(mutex_);
    busy_ = false;
    if (!ok && !hung_up_) hung_up_ = absl::CancelledError();
  }
  Pump();
}

template <typename Message>
void JobStream<Message>::HangUp(const absl::Status& why) {
  {
    const std::lock_guard lock(mutex_);
    if (!hung_up_) hung_up_ = why;
  }
  Pump();
}

template <typename Message>
void JobStream<Message>::OnCancel() {
  HangUp(absl::CancelledError());
}

template <typename Message>
void JobStream<Message>::OnDone() {
  // After this nobody but workers and wakers that are under way holds the call; whatever they do finds it finished.
  const std::shared_ptr<JobStream> self = std::move(self_);
  on_stop_.reset();
}

template class JobStream<v1::JobEvent>;
template class JobStream<v1::SolveEvent>;
template class JobStream<v1::TrajectoryPage>;

// Events.

grpc::ServerWriteReactor<v1::JobEvent>* JobWatchCall::Start(const JobCallEnvironment& environment,
                                                            const absl::StatusOr<Caller>& caller,
                                                            const v1::WatchSolveJobRequest& request) {
  return Begin(std::make_shared<JobWatchCall>(environment, caller, request));
}

absl::Status JobWatchCall::Prepare() {
  if (watch_) return watch_->Fetch();
  if (!caller_.ok()) return caller_.status();
  absl::StatusOr<UserQuota::Ticket> place = environment_.watches.Take(caller_->user);
  if (!place.ok()) return place.status();
  place_ = *std::move(place);
  const absl::StatusOr<jobs::JobId> id = JobIdOf(request_.name());
  if (!id.ok()) return id.status();
  absl::StatusOr<WatchView> view = WatchView::Create(request_);
  if (!view.ok()) return view.status();
  view_ = *std::move(view);
  jobs::EventWatchOptions options;
  options.after = request_.after_sequence();
  options.kept_only = view_.wants_progress_only();
  options.detail = view_.detail();
  options.min_interval = IntervalOf(request_.min_interval());
  const std::weak_ptr<JobStream> weak = weak_from_this();
  auto watch = environment_.manager.Watch(caller_->SeesJobsOf(), *id, options, [weak] {
    if (const auto call = weak.lock()) static_cast<JobWatchCall&>(*call).Pump();
  });
  if (!watch.ok()) return watch.status();
  watch_ = *std::move(watch);
  return absl::OkStatus();
}

absl::StatusOr<JobWatchCall::Got> JobWatchCall::Next(v1::JobEvent& event) {
  if (behind_gap_) return Told(*std::exchange(behind_gap_, std::nullopt), event);
  jobs::EventWatch::Delivery delivery = watch_->Next();
  switch (delivery.got) {
    case jobs::EventWatch::Got::kEvent:
      if (!delivery.gap) return Told(delivery.event, event);
      behind_gap_ = std::move(delivery.event);
      event = ToProto(*delivery.gap, environment_.clock.Now());
      return Got::kMessage;
    case jobs::EventWatch::Got::kHeartbeat:
      event = HeartbeatAfter(watch_->position(), environment_.clock.Now());
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

absl::StatusOr<JobWatchCall::Got> JobWatchCall::Told(const jobs::Event& delivered, v1::JobEvent& event) const {
  event = ToProto(delivered);
  if (event.has_iterate()) view_.Narrow(*event.mutable_iterate());
  if (event.has_analysis()) {
    if (absl::Status admitted = view_.Admits(event.analysis()); !admitted.ok()) return admitted;
  }
  return Got::kMessage;
}

// The trajectory.

grpc::ServerWriteReactor<v1::TrajectoryPage>* ReadTrajectoryCall::Start(const JobCallEnvironment& environment,
                                                                        const absl::StatusOr<Caller>& caller,
                                                                        const v1::ReadTrajectoryRequest& request) {
  return Begin(std::make_shared<ReadTrajectoryCall>(environment, caller, request));
}

absl::Status ReadTrajectoryCall::Prepare() {
  if (!reader_) {
    const absl::StatusOr<jobs::JobId> id = JobIdOf(request_.name());
    if (!id.ok()) return id.status();
    if (!caller_.ok()) return caller_.status();
    absl::StatusOr<TrajectoryReader> reader =
        TrajectoryReader::Create(environment_.manager.store(), caller_->SeesJobsOf(), *id, request_);
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

}  // namespace dlcs
