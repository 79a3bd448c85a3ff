// SPDX-License-Identifier: Apache-2.0
// A job: its request, its owner, and its state.

#ifndef DLCS_SERVER_STORE_JOB_H_
#define DLCS_SERVER_STORE_JOB_H_

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "server/store/clock.h"

namespace dlcs::jobs {

// The numbers are stored: never change one, never reuse one.
enum class JobState {
  kQueued = 1,
  kRunning = 2,
  kCancelling = 3,  // asked to stop, still running
  kSucceeded = 4,   // the work was done; its summary may say that the mathematics has no answer
  kFailed = 5,      // `error` says why
  kCancelled = 6,
};

constexpr bool IsFinal(JobState state) { return state >= JobState::kSucceeded; }

// "QUEUED", "RUNNING", ...
const char* JobStateName(JobState state);

// 26 characters of a-z2-7, 128 random bits: cannot be guessed and is safe in paths, URLs and logs.
using JobId = std::string;
JobId NewJobId();
bool IsJobId(std::string_view text);

// What a job is predicted to need.
struct Demand {
  double core_seconds = 0;
  std::int64_t memory_bytes = 0;
  int threads = 1;
};

struct NewJob {
  JobId id;  // NewJobId()
  std::string owner;
  // If the same owner sends the same request again, it gets the same job; a different `body_hash` with the same
  // request_id is an error. Empty: every request creates a new job. Stored as long as the job.
  std::string request_id;
  std::string body_hash;
  std::string body;     // the request; opaque
  std::string problem;  // id of the owner's uploaded problem that the job needs until it has ended; empty: none
  std::string about;    // a description of the job, available without its body; opaque
  int priority = 0;     // among the owner's jobs; higher ones first
  Demand demand;        // of an ensemble: of one shard
  std::optional<Time> deadline;
  // For an ensemble: the input of each shard; opaque, and deleted with its end. Empty for a solve.
  std::vector<std::string> shards = {};
};

struct Job {
  JobId id;
  std::string owner;
  std::string request_id;
  std::string problem;
  std::string about;
  int priority = 0;
  Demand demand;
  std::optional<Time> deadline;

  JobState state = JobState::kQueued;
  Time created;
  std::optional<Time> started;  // the first attempt
  std::optional<Time> finished;
  int attempts = 0;               // started since the last progress, to detect jobs that crash their server
  std::int64_t sequence = 0;      // the mark: no event has a higher number, in the store or in memory
  std::int64_t last_event = 0;    // in the store
  std::int64_t chunks = 0;        // parts of the trajectory, or results of shards, in the store
  std::int64_t shards = 0;        // of an ensemble; 0 for a solve
  std::string tally = {};         // what the shards of an ensemble counted, or how a solve ended; opaque
  double progress = 0;            // 0 to 1
  absl::Status error;             // of kFailed
  std::int64_t stored_bytes = 0;  // body, chunks, state and events
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_JOB_H_
