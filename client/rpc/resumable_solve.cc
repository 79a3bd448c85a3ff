// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/resumable_solve.h"

#include <algorithm>
#include <utility>

namespace dlcs::client {
namespace {

// The part of `chunk` after the first `taken` times of the trajectory.
v1::TrajectoryChunk Behind(std::int64_t taken, const v1::TrajectoryChunk& chunk) {
  const std::int64_t skipped = std::clamp<std::int64_t>(taken - chunk.first(), 0, chunk.times_size());
  if (skipped == 0) return chunk;
  const auto rest = [&](const google::protobuf::RepeatedField<double>& values) {
    const std::int64_t per_time = values.size() / chunk.times_size();
    return google::protobuf::RepeatedField<double>(values.begin() + skipped * per_time, values.end());
  };
  v1::TrajectoryChunk result;
  result.set_first(chunk.first() + skipped);
  *result.mutable_times() = rest(chunk.times());
  *result.mutable_x() = rest(chunk.x());
  *result.mutable_y() = rest(chunk.y());
  *result.mutable_w() = rest(chunk.w());
  for (const v1::LeftLimit& limit : chunk.left_limits()) {
    if (limit.index() >= result.first()) *result.add_left_limits() = limit;
  }
  return result;
}

}  // namespace

void ResumableSolve::Take(const v1::SolveEvent& event) {
  if (event.has_accepted()) job_ = event.accepted().job();
  if (event.has_trajectory() && event.trajectory().times_size() > 0) {
    times_ = event.trajectory().first() + event.trajectory().times_size();
    last_time_ = *event.trajectory().times().rbegin();
  }
  last_sequence_ = std::max(last_sequence_, event.sequence());
  collector_.Add(event);
  if (on_event_) on_event_(event);
}

absl::Status ResumableSolve::Resume(JobClient& jobs, const CallLimits& limits) {
  if (absl::Status status = Watch(jobs, limits); !status.ok()) return status;
  absl::StatusOr<v1::SolveJob> job = jobs.Get(job_, limits);
  if (!job.ok()) return job.status();
  if (!job->has_summary()) {
    if (job->state() == v1::JOB_STATE_CANCELLED) return absl::CancelledError("the job was cancelled before it started");
    return absl::Status(static_cast<absl::StatusCode>(job->error().code()), job->error().message());
  }
  if (absl::Status status = ReadTrajectory(jobs, limits); !status.ok()) return status;
  v1::SolveEvent end;
  end.set_sequence(last_sequence_);
  end.mutable_summary()->Swap(job->mutable_summary());
  Take(end);
  return absl::OkStatus();
}

absl::Status ResumableSolve::Watch(JobClient& jobs, const CallLimits& limits) {
  v1::WatchSolveJobRequest request;
  request.set_name(job_);
  request.set_after_sequence(last_sequence_);
  return jobs.Watch(
      request,
      [this](const v1::SolveEvent& event) {
        if (!event.has_summary()) return Take(event);
        last_sequence_ = event.sequence();  // taken after the trajectory
      },
      limits);
}

absl::Status ResumableSolve::ReadTrajectory(JobClient& jobs, const CallLimits& limits) {
  v1::ReadTrajectoryRequest request;
  request.set_name(job_);
  if (times_ > 0) request.set_begin(last_time_);
  return jobs.ReadTrajectory(
      request,
      [this](const v1::TrajectoryPage& page) {
        v1::SolveEvent event;
        event.set_sequence(last_sequence_);
        *event.mutable_trajectory() = Behind(times_, page.chunk());
        if (event.trajectory().times_size() > 0) Take(event);
      },
      limits);
}

}  // namespace dlcs::client
