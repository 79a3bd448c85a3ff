// SPDX-License-Identifier: Apache-2.0
// Jobs and their parts, as tests need them.

#ifndef DLCS_TESTS_SERVER_STORE_JOB_SAMPLES_H_
#define DLCS_TESTS_SERVER_STORE_JOB_SAMPLES_H_

#include <memory>
#include <string>

#include "server/store/job_store.h"

namespace dlcs::jobs::testing {

inline NewJob SampleJob(const std::string& owner = "ada", const std::string& body = "a problem") {
  NewJob job;
  job.id = NewJobId();
  job.owner = owner;
  job.body = body;
  job.demand = {.core_seconds = 2.5, .memory_bytes = 1000, .threads = 2};
  return job;
}

inline Event SampleEvent(std::int64_t sequence, EventKind kind, const std::string& payload) {
  return {.sequence = sequence,
          .time = Time(Duration(123'456'789)),
          .kind = kind,
          .payload = std::make_shared<const std::string>(payload)};
}

// Window `number` and the state behind it.
inline Progress SampleWindow(std::int64_t number, std::int64_t sequence) {
  const std::string text = std::to_string(number);
  Progress progress;
  progress.chunks.push_back({.number = number,
                             .begin = static_cast<double>(number),
                             .end = static_cast<double>(number) + 1,
                             .data = "chunk " + text + std::string("\0\xff", 2)});
  progress.state = "state " + text;
  progress.events.push_back(SampleEvent(sequence, EventKind::kWindowAccepted, "window " + text));
  progress.progress = static_cast<double>(number + 1) / 100;
  return progress;
}

// The end of a job whose last event so far has the number `sequence`.
inline Outcome SampleEnd(std::int64_t sequence, JobState state = JobState::kSucceeded) {
  return {.state = state,
          .error = state == JobState::kFailed ? absl::InternalError("it broke") : absl::OkStatus(),
          .events = {SampleEvent(sequence + 1, EventKind::kState, JobStateName(state)),
                     SampleEvent(sequence + 2, EventKind::kSummary, "the end")},
          .tally = "it ended"};
}

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_JOB_SAMPLES_H_
