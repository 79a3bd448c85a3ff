// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/retry.h"

#include <fmt/format.h>
#include <grpcpp/channel.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <random>
#include <string>

#include "client/rpc/rpc_error.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace dlcs::client {
namespace {

using Seconds = std::chrono::duration<double>;
using std::chrono::steady_clock;

constexpr Seconds kFirstPause{0.1};
constexpr Seconds kLongestPause{5};
// Time to wait for a first answer: long enough for a server started by the previous command, short enough for a user.
constexpr Seconds kForFirstAnswer{1};

// Between half and all of `pause`, so that clients that lost their connections together do not all retry together.
Seconds Jittered(Seconds pause) {
  thread_local std::minstd_rand random{std::random_device{}()};
  return pause * std::uniform_real_distribution<double>(0.5, 1)(random);
}

// The delay of RetryInfo, if the server sent one.
std::optional<Seconds> RetryDelay(const grpc::Status& status) {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return std::nullopt;
  for (const auto& detail : details.details()) {
    google::rpc::RetryInfo retry;
    if (!detail.UnpackTo(&retry)) continue;
    return Seconds(static_cast<double>(retry.retry_delay().seconds()) + 1e-9 * retry.retry_delay().nanos());
  }
  return std::nullopt;
}

// Returns early when `stop` is requested.
void Pause(Seconds duration, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any changed;
  std::unique_lock lock(mutex);
  changed.wait_for(lock, stop, duration, [&] { return stop.stop_requested(); });
}

// Returns when there is a connection, `stop` is requested, or the time is over. After a lost connection gRPC waits
// before it connects again, and until then fails every call at once.
void WaitForConnection(grpc::Channel& channel, Seconds most, const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kBetweenLooksAtStop{100};
  const auto end = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(most);
  while (!stop.stop_requested() && steady_clock::now() < end) {
    if (channel.WaitForConnected(std::chrono::system_clock::now() + kBetweenLooksAtStop)) return;
  }
}

}  // namespace

std::string NewRequestId() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

// A stream that breaks in the middle may also end as UNKNOWN or INTERNAL.
bool IsTransient(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::CANCELLED:  // by a server that shuts down; a call that this client cancelled is not retried
      return true;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return RetryDelay(status).has_value();
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::INTERNAL:
      return status.error_details().empty() && status.error_message().find("RST_STREAM") != std::string::npos;
    default:
      return false;
  }
}

namespace {

// As text without a final period.
std::string WhatHappened(const grpc::Status& status) {
  std::string said = status.error_message();
  if (said.empty() || status.error_code() == grpc::StatusCode::CANCELLED) return "the connection was lost";
  if (said.starts_with("failed to connect")) return "no server answers (" + ConnectFailureReason(said) + ")";
  if (said.ends_with('.')) said.pop_back();
  return said;
}

}  // namespace

absl::Status Retry::UntilDeadline(const CallLimits& limits, const Attempt& attempt) const {
  using Repeat = ConnectionOptions::Repeat;
  const Repeat repeat = connection_.options().repeat;
  const auto begin = steady_clock::now();
  const auto within = [begin](Seconds time) {
    return begin + std::chrono::duration_cast<steady_clock::duration>(std::clamp(time, Seconds(0), Seconds(1e9)));
  };
  const auto end_of_call = within(limits.deadline);
  Seconds pause = kFirstPause;
  for (;;) {
    CallLimits left = limits;
    left.deadline = end_of_call - steady_clock::now();
    bool made_progress = false;
    const grpc::Status status = attempt(left, made_progress);
    if (status.ok() || made_progress ||
        (Connection::IsAnswer(status) && status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED)) {
      connection_.NoteAnswer();
    }
    if (status.ok()) return absl::OkStatus();
    const bool known = connection_.has_answered() || repeat == Repeat::kAlways;
    const auto end = known ? end_of_call : std::min(end_of_call, within(kForFirstAnswer));
    if (made_progress) pause = kFirstPause;
    const Seconds wait = std::max(Jittered(pause), RetryDelay(status).value_or(Seconds(0)));
    const bool in_time = steady_clock::now() + wait < end;
    if (!IsTransient(status) || repeat == Repeat::kNever || !in_time || limits.stop.stop_requested())
      return connection_.Describe(status);
    if (const auto never = connection_.PermanentFailure(status)) return *never;
    if (notice_ && known) notice_(fmt::format("{}; retrying in {:.1f} s", WhatHappened(status), wait.count()));
    Pause(wait, limits.stop);
    WaitForConnection(*connection_.channel(), std::min<Seconds>(kLongestPause, end - steady_clock::now()), limits.stop);
    // The last real error; a call without time left would only report the deadline.
    if (steady_clock::now() >= end) return connection_.Describe(status);
    pause = std::min(2 * pause, kLongestPause);
  }
}

}  // namespace dlcs::client
