// SPDX-License-Identifier: Apache-2.0
#include "server/analyze_call.h"

#include <utility>

#include "absl/status/statusor.h"
#include "server/errors.h"
#include "server/guarded.h"
#include "server/status.h"

namespace dlcs {

grpc::ServerUnaryReactor* AnalyzeCall::Start(const CallEnvironment& environment,
                                             const v1::AnalyzeProblemRequest& request,
                                             v1::AnalyzeProblemResponse& response) {
  const auto call = std::make_shared<AnalyzeCall>(environment, request, response);
  call->self_ = call;
  call->Begin();
  return call.get();
}

void AnalyzeCall::Begin() {
  control_ = environment_.calls.Register();
  if (control_ == nullptr) return Finish(ToGrpc(ShuttingDown()));
  absl::StatusOr<Admission::Ticket> solver = environment_.admission.TakeSolver();
  if (!solver.ok()) return Finish(ToGrpc(solver.status()));
  solver_ = *std::move(solver);
  environment_.workers.Run([self = shared_from_this()] { self->Work(); });
}

void AnalyzeCall::Work() {
  absl::StatusOr<v1::AnalyzeProblemResponse> result =
      Guarded("analysis", [this] { return RunAnalysis(request_, environment_.limits, control_->token()); });
  solver_.reset();
  if (control_->cause() == StopCause::kShutdown) return Finish(ToGrpc(ShuttingDown()));
  if (result.ok()) response_ = *std::move(result);
  Finish(ToGrpc(result.status()));
}

void AnalyzeCall::OnCancel() {
  if (control_ != nullptr) control_->Stop(StopCause::kCancelled);
}

void AnalyzeCall::OnDone() {
  // May be the last share: moved out first, so that nobody destroys the pointer that is being reset.
  const std::shared_ptr<AnalyzeCall> self = std::move(self_);
}

}  // namespace dlcs
