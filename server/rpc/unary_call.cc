// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/unary_call.h"

#include "server/jobs/catch_exceptions.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"

namespace dlcs {

grpc::ServerUnaryReactor* UnaryCall::Start(CallEnvironment& environment, CallKind kind, const char* name, Work work) {
  const auto call = std::make_shared<UnaryCall>(environment, kind, name, std::move(work));
  call->self_ = call;
  if (const absl::Status admitted = call->Admit(); !admitted.ok()) {
    call->Finish(ToGrpc(admitted));
  } else {
    environment.WorkersFor(kind).Run([call] { call->DoWork(); });
  }
  return call.get();
}

absl::Status UnaryCall::Admit() {
  control_ = environment_.calls.Register(kind_);
  if (control_ == nullptr) return ShuttingDown();
  if (kind_ == CallKind::kStore) return absl::OkStatus();
  absl::StatusOr<Admission::Ticket> solver = environment_.admission.TakeSolver();
  if (!solver.ok()) return solver.status();
  solver_ = *std::move(solver);
  return absl::OkStatus();
}

void UnaryCall::DoWork() {
  const absl::Status done = CatchExceptions(name_, [this] { return work_(control_->token()); });
  solver_.reset();
  const bool stopped = kind_ == CallKind::kCompute && control_->cause() == StopCause::kShutdown;
  Finish(ToGrpc(stopped ? ShuttingDown() : done));
}

void UnaryCall::OnCancel() {
  if (control_ != nullptr) control_->Stop(StopCause::kCancelled);
}

void UnaryCall::OnDone() {
  // May be the last reference: moved out first, so that the pointer is not destroyed while it is being reset.
  const std::shared_ptr<UnaryCall> self = std::move(self_);
}

}  // namespace dlcs
