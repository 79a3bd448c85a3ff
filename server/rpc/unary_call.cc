// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/unary_call.h"

#include <utility>

#include "absl/status/statusor.h"
#include "server/jobs/catch_exceptions.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"

namespace dlcs {

grpc::ServerUnaryReactor* UnaryCall::Start(const CallEnvironment& environment, const char* name, Work work) {
  const auto call = std::make_shared<UnaryCall>(environment, name, std::move(work));
  call->self_ = call;
  call->Begin();
  return call.get();
}

void UnaryCall::Begin() {
  control_ = environment_.calls.Register();
  if (control_ == nullptr) return Finish(ToGrpc(ShuttingDown()));
  absl::StatusOr<Admission::Ticket> solver = environment_.admission.TakeSolver();
  if (!solver.ok()) return Finish(ToGrpc(solver.status()));
  solver_ = *std::move(solver);
  environment_.workers.Run([self = shared_from_this()] { self->DoWork(); });
}

void UnaryCall::DoWork() {
  const absl::Status done = CatchExceptions(name_, [this] { return work_(control_->token()); });
  solver_.reset();
  Finish(ToGrpc(control_->cause() == StopCause::kShutdown ? ShuttingDown() : done));
}

void UnaryCall::OnCancel() {
  if (control_ != nullptr) control_->Stop(StopCause::kCancelled);
}

void UnaryCall::OnDone() {
  // May be the last share: moved out first, so that nobody destroys the pointer that is being reset.
  const std::shared_ptr<UnaryCall> self = std::move(self_);
}

}  // namespace dlcs
