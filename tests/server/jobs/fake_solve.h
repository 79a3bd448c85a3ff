// SPDX-License-Identifier: Apache-2.0
// Work whose result is known: a chain of windows, each of which depends on all before it.

#ifndef DLCS_TESTS_SERVER_JOBS_FAKE_SOLVE_H_
#define DLCS_TESTS_SERVER_JOBS_FAKE_SOLVE_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "server/jobs/job_manager.h"

namespace dlcs::jobs::testing {

// The state after `window`, from the state before it. A wrong resume would change it.
inline std::uint64_t NextState(std::uint64_t state, std::int64_t window) {
  state ^= static_cast<std::uint64_t>(window) + 0x9e3779b97f4a7c15u + (state << 6) + (state >> 2);
  return state * 6364136223846793005u + 1442695040888963407u;
}

inline std::string ChunkOf(std::uint64_t state) { return "chunk of " + std::to_string(state); }

// The whole trajectory of a job with so many windows.
inline std::string Trajectory(std::int64_t windows) {
  std::string text;
  std::uint64_t state = 1;
  for (std::int64_t k = 0; k < windows; ++k) text += ChunkOf(state = NextState(state, k)) + ";";
  return text;
}

// What the store has of it.
inline std::string Trajectory(JobStore& store, const JobId& id) {
  std::string text;
  const auto chunks = store.ReadChunks(id, 0, 1 << 30);
  if (!chunks.ok()) return chunks.status().ToString();
  for (const Chunk& chunk : *chunks) text += chunk.data + ";";
  return text;
}

// What the work does: "windows iterates microseconds-per-iterate"; "throw"; "wait" until it is stopped; "unreachable":
// the first two calls of all cannot read the store; "break down": always, or with "twice" two times.
inline JobEnd FakeSolve(JobRun& run) {
  if (run.body() == "throw") throw std::runtime_error("the engine broke");
  if (run.body() == "unreachable") {
    static std::atomic<int> calls{0};
    return {++calls < 3 ? absl::UnavailableError("no store") : absl::OkStatus(), "solved"};
  }
  if (run.body() == "break down twice") {
    if (run.job().attempts < 3) return {absl::AbortedError("a process that it needs is gone"), ""};
    return {absl::OkStatus(), "solved"};
  }
  if (run.body() == "break down") return {absl::AbortedError("a process that it needs is gone"), ""};
  if (run.body() == "fail") return {absl::InvalidArgumentError("no such problem"), ""};
  std::int64_t windows = 0, iterates = 0, pause_us = 0;
  std::istringstream(run.body()) >> windows >> iterates >> pause_us;
  std::uint64_t state = run.resume_state().has_value() ? std::stoull(*run.resume_state()) : 1;
  if (!run.resume_state().has_value()) run.Emit(EventKind::kAnalysis, "analysis");
  for (std::int64_t k = run.num_accepted(); k < windows || run.body() == "wait"; ++k) {
    for (std::int64_t i = 0; i < iterates || run.body() == "wait"; ++i) {
      if (run.stop().stop_requested()) return {absl::CancelledError(), "stopped in window " + std::to_string(k)};
      std::string iterate = "iterate " + std::to_string(i);
      if (const std::size_t times = run.WantedDetail()->most_times; times > 0) {
        iterate += ", " + std::to_string(times) + " values";
      }
      run.Emit(EventKind::kIterate, std::move(iterate));
      std::this_thread::sleep_for(std::chrono::microseconds(run.body() == "wait" ? 500 : pause_us));
    }
    state = NextState(state, k);
    run.Accept({.begin = static_cast<double>(k),
                .end = static_cast<double>(k + 1),
                .trajectory = ChunkOf(state),
                .state = std::to_string(state),
                .event = "window " + std::to_string(k),
                .progress = static_cast<double>(k + 1) / static_cast<double>(windows)});
  }
  return {absl::OkStatus(), "solved"};
}

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_JOBS_FAKE_SOLVE_H_
