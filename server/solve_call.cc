// SPDX-License-Identifier: Apache-2.0
#include "server/solve_call.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <random>
#include <utility>

#include "core/solution.h"
#include "fmt/format.h"
#include "server/errors.h"
#include "server/guarded.h"
#include "server/status.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

using SystemClock = std::chrono::system_clock;

// How long before the deadline an engine is stopped: time to notice and to compute the certificate, and time
// to hand over the trajectory at what one busy gigabit link carries.
constexpr double kMaxWindDown_s = 1;
constexpr double kDeliveryBytesPerSecond = 100e6;

constexpr std::int64_t kLargeResultBytes = 16 << 20;

// Distinct among the calls of this process, and very likely among processes.
std::string NewSolveId() {
  static const unsigned process = std::random_device{}();
  static std::atomic<std::uint64_t> count{0};
  return fmt::format("solve-{:08x}-{}", process, ++count);
}

void LogSolve(const std::string& id, const PreparedSolve& prepared, const FinishedSolve& finished) {
  const Solution& solution = finished.solution();
  spdlog::info("{}: {} states, {} constraints, {} steps, {}, {}, {:.3f} s", id, prepared.num_states(),
               prepared.num_constraints(), solution.cost.steps, MethodName(solution.method),
               v1::Termination_Name(finished.termination()), solution.cost.seconds_total);
}

}  // namespace

grpc::ServerWriteReactor<v1::SolveEvent>* SolveCall::Start(const CallEnvironment& environment,
                                                           grpc::CallbackServerContext& context,
                                                           const v1::SolveRequest& request) {
  const auto call = std::make_shared<SolveCall>(environment, context, request);
  call->self_ = call;
  call->Begin();
  return call.get();
}

SolveCall::SolveCall(const CallEnvironment& environment, grpc::CallbackServerContext& context,
                     const v1::SolveRequest& request)
    : environment_(environment), context_(context), request_(request), id_(NewSolveId()) {}

void SolveCall::Begin() {
  control_ = environment_.calls.Register();
  if (control_ == nullptr) return Finish(ToGrpc(ShuttingDown()));
  absl::StatusOr<Admission::Ticket> solver = environment_.admission.TakeSolver();
  if (!solver.ok()) {
    spdlog::warn("{}: refused: {}", id_, std::string(solver.status().message()));
    return Finish(ToGrpc(solver.status()));
  }
  solver_ = *std::move(solver);
  // The worker starts when the headers are sent: before, gRPC has not taken the reactor over and a first
  // message could be lost.
  StartSendInitialMetadata();
}

void SolveCall::StopBeforeDeadline(std::int64_t result_bytes) {
  const SystemClock::time_point now = SystemClock::now();
  const SystemClock::time_point deadline = context_.deadline();
  // gRPC's "no deadline" is the end of time; a century is as good and safe to compute with.
  if (deadline > now + std::chrono::hours(24 * 365 * 100)) return;
  const double left_s = std::max(0.0, std::chrono::duration<double>(deadline - now).count());
  const double delivery_s = static_cast<double>(result_bytes) / kDeliveryBytesPerSecond;
  const double margin_s = std::min(std::min(left_s / 10, kMaxWindDown_s) + delivery_s, left_s / 2);
  const auto margin =
      std::chrono::duration_cast<SystemClock::duration>(std::chrono::duration<double>(margin_s));
  alarm_.Set(deadline - margin, [control = std::weak_ptr(control_)](bool rang) {
    if (const auto stopped = control.lock(); rang && stopped) stopped->Stop(StopCause::kDeadline);
  });
}

void SolveCall::OnSendInitialMetadataDone(bool ok) {
  if (!ok) HangUp(StopCause::kCancelled);
  environment_.workers.Run([self = shared_from_this()] { self->Work(); });
}

void SolveCall::Work() {
  absl::StatusOr<FinishedSolve> finished = Guarded(id_, [this] { return Solve(); });
  if (!finished.ok()) {
    spdlog::info("{}: {}: {}", id_, absl::StatusCodeToString(finished.status().code()),
                 std::string(finished.status().message()));
  }
  mailbox_.Close(std::move(finished));
  solver_.reset();
  Pump();
}

absl::StatusOr<FinishedSolve> SolveCall::Solve() {
  absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request_, environment_.limits);
  if (!prepared.ok()) return prepared.status();
  absl::StatusOr<Admission::Ticket> result = environment_.admission.HoldResult(prepared->result_bytes);
  if (!result.ok()) return result.status();
  result_ = *std::move(result);
  StopBeforeDeadline(prepared->result_bytes);
  absl::StatusOr<FinishedSolve> finished = RunSolve(*prepared, id_, *control_, *this, environment_.setups);
  if (finished.ok()) LogSolve(id_, *prepared, *finished);
  // What the engine took to work with goes back to the system while a large result waits for its reader.
  if (prepared->result_bytes > kLargeResultBytes) malloc_trim(0);
  return finished;
}

void SolveCall::Accept(v1::SolveEvent event) {
  mailbox_.Put(std::move(event));
  Pump();
}

void SolveCall::Pump() {
  const std::lock_guard lock(mutex_);
  if (writing_ || finished_) return;
  if (hung_up_) {
    if (!mailbox_.closed()) return;
    finished_ = true;
    return Finish(grpc::Status::CANCELLED);
  }
  switch (mailbox_.Next(event_)) {
    case EventMailbox::Got::kEvent:
      writing_ = true;
      // While more events wait they travel together: gRPC sends what it holds with the last of them.
      return StartWrite(&event_,
                        mailbox_.size() > 0 ? grpc::WriteOptions().set_buffer_hint() : grpc::WriteOptions());
    case EventMailbox::Got::kNothing:
      return;
    case EventMailbox::Got::kEnd:
      finished_ = true;
      return Finish(ToGrpc(mailbox_.status()));
  }
}

void SolveCall::OnWriteDone(bool ok) {
  if (!ok) HangUp(StopCause::kCancelled);
  {
    const std::lock_guard lock(mutex_);
    writing_ = false;
  }
  Pump();
}

void SolveCall::OnCancel() {
  HangUp(SystemClock::now() >= context_.deadline() ? StopCause::kDeadline : StopCause::kCancelled);
  Pump();
}

void SolveCall::HangUp(StopCause cause) {
  if (control_ != nullptr) control_->Stop(cause);
  const std::lock_guard lock(mutex_);
  hung_up_ = true;
}

void SolveCall::OnDone() {
  // May be the last share: moved out first, so that nobody destroys the pointer that is being reset.
  const std::shared_ptr<SolveCall> self = std::move(self_);
}

}  // namespace dlcs
