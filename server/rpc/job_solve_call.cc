// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/job_solve_call.h"

#include <utility>

#include "server/access/credentials.h"
#include "server/solve_jobs/convert_job.h"
#include "server/solve_jobs/resource_names.h"
#include "server/solve_jobs/watch_view.h"

namespace dlcs {
namespace {

// The summary of a job that ended before anything was solved. Errors: that of a job that failed for another reason than
// its deadline.
absl::StatusOr<v1::Summary> SummaryWithoutSolve(const jobs::Job& job) {
  v1::Summary summary;
  if (job.state == jobs::JobState::kCancelled) {
    summary.set_termination(v1::TERMINATION_CANCELLED);
    summary.set_message("The job was cancelled before it started.");
    return summary;
  }
  if (!absl::IsDeadlineExceeded(job.error)) return job.error;
  summary.set_termination(v1::TERMINATION_DEADLINE);
  summary.set_message(std::string(job.error.message()));
  return summary;
}

}  // namespace

absl::Status JobSolveCall::Work() {
  if (!watch_) return BeginToWatch();
  if (last_sequence_ == 0) return watch_->Fetch();
  if (!reader_) return BeginToRead();
  return ReadPage();
}

absl::Status JobSolveCall::BeginToWatch() {
  const absl::StatusOr<Caller> caller = CallerOf(environment_.access, context_);
  if (!caller.ok()) return caller.status();
  absl::StatusOr<v1::Accepted> accepted = create_(*caller);
  if (!accepted.ok()) return accepted.status();
  absl::StatusOr<jobs::JobId> id = JobIdOf(accepted->job());
  if (!id.ok()) return id.status();
  id_ = *std::move(id);
  auto watch = environment_.jobs->manager().Watch(std::nullopt, id_, {}, Waker());
  if (!watch.ok()) return watch.status();
  watch_ = *std::move(watch);
  next_.emplace();
  *next_->mutable_time() = ToProto(jobs::SystemClock().Now());
  *next_->mutable_accepted() = *std::move(accepted);
  return absl::OkStatus();
}

absl::Status JobSolveCall::BeginToRead() {
  if (summary_->termination() == v1::TERMINATION_UNSPECIFIED) {
    const absl::StatusOr<jobs::Job> job = environment_.jobs->manager().store().Get(std::nullopt, id_);
    if (!job.ok()) return job.status();
    absl::StatusOr<v1::Summary> summary = SummaryWithoutSolve(*job);
    if (!summary.ok()) return summary.status();
    summary_ = *std::move(summary);
  }
  absl::StatusOr<TrajectoryReader> reader =
      TrajectoryReader::Create(environment_.jobs->manager().store(), std::nullopt, id_, {});
  if (!reader.ok()) return reader.status();
  reader_ = *std::move(reader);
  return ReadPage();
}

absl::Status JobSolveCall::ReadPage() {
  absl::StatusOr<std::optional<v1::TrajectoryPage>> page = reader_->Next();
  if (!page.ok()) return page.status();
  next_.emplace();
  next_->set_sequence(last_sequence_);
  *next_->mutable_time() = ToProto(jobs::SystemClock().Now());
  if (page->has_value() && (*page)->chunk().times_size() > 0) {
    next_->mutable_trajectory()->Swap((*page)->mutable_chunk());
  } else {
    next_->mutable_summary()->Swap(&*summary_);
    ended_ = true;
  }
  return absl::OkStatus();
}

absl::StatusOr<JobSolveCall::Got> JobSolveCall::Next(v1::SolveEvent& event) {
  if (next_) {
    event = *std::exchange(next_, std::nullopt);
    return Got::kMessage;
  }
  if (ended_) return Got::kEnd;
  return last_sequence_ > 0 ? Got::kBlocks : NextOfJob(event);
}

JobSolveCall::Got JobSolveCall::NextOfJob(v1::SolveEvent& event) {
  jobs::EventWatch::Delivery delivery = watch_->Next();
  switch (delivery.got) {
    case jobs::EventWatch::Got::kEvent: {
      v1::SolveEvent of_job = ToProto(delivery.event);
      if (of_job.has_iterate()) WatchView().Narrow(*of_job.mutable_iterate());  // others may watch with values
      if (of_job.has_summary()) {
        last_sequence_ = of_job.sequence();
        summary_ = of_job.summary();  // sent after the trajectory
      } else {
        next_ = std::move(of_job);
      }
      if (delivery.gap) {
        event = ToProto(*delivery.gap, jobs::SystemClock().Now());
        return Got::kMessage;
      }
      if (!next_) return Got::kBlocks;
      event = *std::exchange(next_, std::nullopt);
      return Got::kMessage;
    }
    case jobs::EventWatch::Got::kHeartbeat:
      event = HeartbeatAfter(watch_->position(), jobs::SystemClock().Now());
      return Got::kMessage;
    case jobs::EventWatch::Got::kNothing:
      return Got::kNothing;
    case jobs::EventWatch::Got::kArchived:
      return Got::kBlocks;
    case jobs::EventWatch::Got::kEnd:
      return Got::kEnd;
  }
  return Got::kEnd;
}

}  // namespace dlcs
