// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/call_admission.h"

#include <algorithm>
#include <atomic>
#include <random>
#include <utility>

#include "fmt/format.h"
#include "server/access/credentials.h"
#include "server/log.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

using SystemClock = std::chrono::system_clock;

// How long before the deadline an engine is stopped: time to notice and to compute the certificate, and time
// to hand over the trajectory at what one busy gigabit link carries.
constexpr double kMaxWindDown_s = 1;
constexpr double kDeliveryBytesPerSecond = 100e6;

std::string NewSolveId() {
  static const unsigned process = std::random_device{}();
  static std::atomic<std::uint64_t> count{0};
  return fmt::format("solve-{:08x}-{}", process, ++count);
}

}  // namespace

ProblemResolver ProblemsOf(const CallEnvironment& environment, const grpc::CallbackServerContext& call) {
  if (environment.problems == nullptr) return {};
  // Who calls is looked up for requests that name a problem, not for all.
  return [&environment, &call](const std::string& name) -> absl::StatusOr<v1::ProblemBody> {
    const absl::StatusOr<Caller> caller = CallerOf(environment.access, call);
    if (!caller.ok()) return caller.status();
    return environment.problems->Of(caller->user)(name);
  };
}

CallLifetime::CallLifetime(const CallEnvironment& environment) : environment_(environment), id_(NewSolveId()) {}

absl::Status CallLifetime::Admit(const std::string& user) {
  control_ = environment_.calls.Register({.id = id_, .user = user});
  if (control_ == nullptr) return ShuttingDown();
  absl::StatusOr<Admission::Ticket> solver = environment_.admission.TakeSolver();
  if (!solver.ok()) {
    Log(spdlog::level::warn, "solve refused", {{"solve", id_}, {"error", std::string(solver.status().message())}});
    return solver.status();
  }
  solver_ = *std::move(solver);
  return absl::OkStatus();
}

absl::Status CallLifetime::HoldResult(std::int64_t bytes) {
  absl::StatusOr<Admission::Ticket> result = environment_.admission.HoldResult(bytes);
  if (!result.ok()) return result.status();
  result_ = *std::move(result);
  return absl::OkStatus();
}

void CallLifetime::StopBeforeDeadline(SystemClock::time_point deadline, std::int64_t result_bytes) {
  const SystemClock::time_point now = SystemClock::now();
  // gRPC's "no deadline" is the end of time; a century is as good and safe to compute with.
  if (deadline > now + std::chrono::hours(24 * 365 * 100)) return;
  const double left_s = std::max(0.0, std::chrono::duration<double>(deadline - now).count());
  const double delivery_s = static_cast<double>(result_bytes) / kDeliveryBytesPerSecond;
  const double margin_s = std::min(std::min(left_s / 10, kMaxWindDown_s) + delivery_s, left_s / 2);
  const auto margin = std::chrono::duration_cast<SystemClock::duration>(std::chrono::duration<double>(margin_s));
  alarm_.Set(deadline - margin, [control = std::weak_ptr(control_)](bool rang) {
    if (const auto stopped = control.lock(); rang && stopped) stopped->Stop(StopCause::kDeadline);
  });
}

void CallLifetime::End() {
  result_.reset();
  control_.reset();
}

void CallLifetime::Stop(StopCause cause) {
  if (control_ != nullptr) control_->Stop(cause);
}

}  // namespace dlcs
