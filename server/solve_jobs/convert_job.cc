// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/convert_job.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>

#include "server/solve_jobs/resource_names.h"

namespace dlcs {
namespace {

constexpr std::int64_t kMicroseconds = 1'000'000;

constexpr std::array kStates = {jobs::JobState::kQueued,    jobs::JobState::kRunning, jobs::JobState::kCancelling,
                                jobs::JobState::kSucceeded, jobs::JobState::kFailed,  jobs::JobState::kCancelled};

v1::JobState StateNamed(std::string_view name) {
  for (const jobs::JobState state : kStates) {
    if (name == jobs::JobStateName(state)) return ToProto(state);
  }
  return v1::JOB_STATE_UNSPECIFIED;
}

v1::Gap::Reason ToProto(jobs::EventGap::Why why) {
  switch (why) {
    case jobs::EventGap::Why::kInterval:
      return v1::Gap::REASON_INTERVAL;
    case jobs::EventGap::Why::kSlow:
      return v1::Gap::REASON_SLOW;
    case jobs::EventGap::Why::kNotRetained:
      return v1::Gap::REASON_NOT_RETAINED;
  }
  return v1::Gap::REASON_UNSPECIFIED;
}

}  // namespace

google::protobuf::Timestamp ToProto(jobs::Time time) {
  const std::int64_t us = time.time_since_epoch().count();
  google::protobuf::Timestamp result;
  const std::int64_t rest = ((us % kMicroseconds) + kMicroseconds) % kMicroseconds;
  result.set_seconds((us - rest) / kMicroseconds);
  result.set_nanos(static_cast<int>(rest) * 1000);
  return result;
}

jobs::Time FromProto(const google::protobuf::Timestamp& time) {
  constexpr std::int64_t kMaxSeconds = 300'000'000'000;  // beyond the year 9999, where timestamps end
  return jobs::Time(std::chrono::seconds(std::clamp(time.seconds(), -kMaxSeconds, kMaxSeconds)) +
                    std::chrono::microseconds(time.nanos() / 1000));
}

v1::JobState ToProto(jobs::JobState state) {
  // Both enumerations have the same numbers (server/store/job.h, solver.proto); neither may change.
  return static_cast<v1::JobState>(static_cast<int>(state));
}

std::optional<jobs::JobState> FromProto(v1::JobState state) {
  for (const jobs::JobState known : kStates) {
    if (ToProto(known) == state) return known;
  }
  return std::nullopt;
}

v1::SolveJob ToProto(const jobs::Job& job) {
  v1::SolveJob result;
  result.ParseFromString(job.about);  // nothing, of a job from before that was kept
  result.set_name(JobName(job.id));
  result.set_owner(job.owner);
  result.set_state(ToProto(job.state));
  result.set_request_id(job.request_id);
  result.set_priority(job.priority);
  *result.mutable_create_time() = ToProto(job.created);
  if (job.started) *result.mutable_start_time() = ToProto(*job.started);
  if (job.finished) *result.mutable_end_time() = ToProto(*job.finished);
  if (job.deadline) *result.mutable_deadline() = ToProto(*job.deadline);
  result.set_attempts(job.attempts);
  result.set_progress(job.progress);
  result.set_last_sequence(job.last_event);
  result.set_stored_bytes(job.stored_bytes);
  result.set_predicted_core_seconds(job.demand.core_seconds *
                                    static_cast<double>(std::max<std::int64_t>(job.shards, 1)));
  result.set_predicted_memory_bytes(job.demand.memory_bytes);
  if (!job.problem.empty()) result.set_problem_name(ProblemName(job.problem));
  if (job.shards > 0) {
    result.mutable_ensemble()->set_shards_done(static_cast<int>(job.chunks));
    result.mutable_ensemble()->mutable_counts()->ParseFromString(job.tally);
  }
  if (!job.error.ok()) {
    result.mutable_error()->set_code(static_cast<int>(job.error.code()));
    result.mutable_error()->set_message(std::string(job.error.message()));
  }
  return result;
}

int RanksOf(const std::string& about) {
  v1::SolveJob job;
  return job.ParseFromString(about) ? job.options().ranks() : 0;
}

v1::SolveEvent ToProto(const jobs::Event& event) {
  v1::SolveEvent result;
  switch (event.kind) {
    case jobs::EventKind::kState:
      result.set_state(StateNamed(*event.payload));
      break;
    case jobs::EventKind::kSummary:
      result.mutable_summary();
      if (!event.payload->empty()) result.mutable_summary()->ParseFromString(*event.payload);
      break;
    case jobs::EventKind::kAnalysis:
    case jobs::EventKind::kWindowAccepted:
    case jobs::EventKind::kIterate:
    case jobs::EventKind::kWindowStarted:
    case jobs::EventKind::kWindowRejected:
    case jobs::EventKind::kLog:
    case jobs::EventKind::kWindowFinished:
      result.ParseFromString(*event.payload);
      break;
  }
  result.set_sequence(event.sequence);
  *result.mutable_time() = ToProto(event.time);
  return result;
}

v1::SolveEvent ToProto(const jobs::EventGap& gap, jobs::Time now) {
  v1::SolveEvent result;
  result.set_sequence(gap.last);
  *result.mutable_time() = ToProto(now);
  result.mutable_gap()->set_first_sequence(gap.first);
  result.mutable_gap()->set_last_sequence(gap.last);
  result.mutable_gap()->set_reason(ToProto(gap.why));
  return result;
}

v1::SolveEvent HeartbeatAfter(std::int64_t sequence, jobs::Time now) {
  v1::SolveEvent result;
  result.set_sequence(sequence);
  *result.mutable_time() = ToProto(now);
  result.mutable_heartbeat();
  return result;
}

}  // namespace dlcs
