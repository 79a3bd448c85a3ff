// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/upload_call.h"

#include <chrono>
#include <utility>

#include "server/access/audit.h"
#include "server/jobs/catch_exceptions.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"

namespace dlcs {
namespace {

constexpr std::chrono::milliseconds kRetryUploadAfter{1000};

}  // namespace

absl::Status UploadSlot::AllTaken() { return ServerBusy("max_uploads_at_once", UploadSlots::kMax, kRetryUploadAfter); }

grpc::ServerReadReactor<v1::UploadProblemRequest>* UploadCall::Start(CallEnvironment& environment, UploadSlots& slots,
                                                                     const absl::StatusOr<Caller>& caller,
                                                                     v1::UploadProblemResponse& response) {
  const auto call = std::make_shared<UploadCall>(environment, slots, caller, response);
  call->self_ = call;
  call->Admit();
  return call.get();
}

void UploadCall::Admit() {
  control_ = environment_.calls.Register(CallKind::kStore);
  if (control_ == nullptr) return End(ShuttingDown());
  if (!caller_.ok()) return End(caller_.status());
  slot_.emplace(slots_);
  if (!slot_->is_free()) return End(UploadSlot::AllTaken());
  const std::weak_ptr<UploadCall> weak = weak_from_this();
  // On another thread: the registry, which stops all calls, holds the lock that the end of this one needs.
  on_stop_.emplace(control_->token(), [weak, &workers = environment_.store_workers] {
    workers.Run([weak] {
      if (const auto call = weak.lock()) call->End(ShuttingDown());
    });
  });
  ReadNext();
}

void UploadCall::ReadNext() {
  const std::lock_guard lock(mutex_);
  if (!ended_) StartRead(&part_);
}

void UploadCall::OnReadDone(bool ok) {
  if (cancelled_) return End(absl::CancelledError());
  if (!begun_) {
    if (!ok) return End(InvalidRequest({{"part", "the upload ended before its `start`"}}));
    begun_ = true;
    return BeginOnWorker();
  }
  if (!ok) return StoreOnWorker();
  if (const absl::Status taken = upload_.Take(part_); !taken.ok()) return End(taken);
  ReadNext();
}

void UploadCall::BeginOnWorker() {
  environment_.store_workers.Run([self = shared_from_this()] {
    const auto there = CatchExceptions("upload", [&] { return self->upload_.Begin(self->part_); });
    if (!there.ok()) return self->End(there.status());
    if (!there->has_value()) return self->ReadNext();
    self->End(**there);
  });
}

void UploadCall::StoreOnWorker() {
  environment_.store_workers.Run(
      [self = shared_from_this()] { self->End(CatchExceptions("upload", [&] { return self->upload_.Store(); })); });
}

void UploadCall::End(const absl::StatusOr<v1::UploadProblemResponse>& end) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(ended_, true)) return;
  if (end.ok()) response_ = *end;
  if (caller_.ok()) {
    Audit({.user = caller_->user,
           .method = "UploadProblem",
           .object = end.ok() ? end->problem().name() : std::string(),
           .outcome = end.status().code(),
           .peer = caller_->peer});
  }
  Finish(ToGrpc(end.status()));
}

void UploadCall::OnDone() {
  // May be the last reference: moved out first, so that the pointer is not destroyed while it is being reset.
  const std::shared_ptr<UploadCall> self = std::move(self_);
  on_stop_.reset();
  slot_.reset();
}

}  // namespace dlcs
