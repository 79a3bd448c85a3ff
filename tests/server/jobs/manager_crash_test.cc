// SPDX-License-Identifier: Apache-2.0
// kill -9 of a whole server at random moments, with a watcher that follows its job through all restarts.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/job_manager.h"
#include "server/store/sqlite/sqlite_job_store.h"
#include "tests/server/jobs/fake_solve.h"
#include "tests/server/jobs/job_follower.h"
#include "tests/server/store/random_kills.h"
#include "tests/server/store/short_life.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using testing::FakeSolve;
using testing::JobFollower;
using testing::Trajectory;

constexpr int kWindows = 6;

absl::StatusOr<Demand> Cost(const Submission&) {
  return Demand{.core_seconds = 0.01, .memory_bytes = 1000, .threads = 1};
}

JobManagerOptions Options() {
  JobManagerOptions options;
  options.limits.cores = 2;
  options.poll = 20ms;
  return options;
}

// A server with one user. The user submits a job whenever fewer than four are unfinished, watches the oldest one from
// where the previous process stopped, and writes to `pipe` what was acknowledged and seen. Never returns.
[[noreturn]] void Serve(const std::string& path, int pipe, const std::map<JobId, std::int64_t>& positions) {
  const auto say = [pipe](const std::string& line) { testing::Say(pipe, line); };
  SqliteJobStore store({.path = path}, SystemClock());
  JobManager manager(Options(), store, &Cost, FakeSolve, SystemClock());
  for (;;) {
    const auto unfinished =
        store.List({.owner = "ada", .states = {JobState::kQueued, JobState::kRunning, JobState::kCancelling}}, 10, "");
    if (!unfinished.ok()) _exit(1);
    std::vector<Job> jobs = unfinished->jobs;
    while (jobs.size() < 4) {
      Submission submission;
      submission.owner = "ada";
      submission.body = std::to_string(kWindows) + " 3 500";
      const auto created = manager.Submit(submission);
      if (!created.ok()) _exit(1);
      say("created " + created->job.id + "\n");
      jobs.insert(jobs.begin(), created->job);
    }
    const JobId id = jobs.back().id;
    const auto known = positions.find(id);
    EventWatchOptions options;
    options.after = known == positions.end() ? 0 : known->second;
    const auto watch = manager.Watch("ada", id, options, [] {});
    if (!watch.ok()) {
      say("error " + watch.status().ToString() + "\n");
      _exit(1);
    }
    for (bool ended = false; !ended;) {
      const EventWatch::Delivery delivery = (*watch)->Next();
      if (delivery.got == EventWatch::Got::kArchived && !(*watch)->Fetch().ok()) _exit(1);
      if (delivery.got == EventWatch::Got::kNothing) std::this_thread::sleep_for(200us);
      if (delivery.got == EventWatch::Got::kEnd) break;
      if (delivery.got != EventWatch::Got::kEvent) continue;
      const std::int64_t first = delivery.gap.has_value() ? delivery.gap->first : delivery.event.sequence;
      ended = delivery.event.kind == EventKind::kSummary;
      say("saw " + id + " " + std::to_string(first) + " " + std::to_string(delivery.event.sequence) + " " +
          std::to_string(static_cast<int>(delivery.event.kind)) + " " + *delivery.event.payload + "\n");
    }
  }
}

struct Seen {
  std::set<JobId> created;
  std::map<JobId, std::int64_t> positions;
  std::map<JobId, std::vector<std::string>> durable;
  std::string errors;

  void Read(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string what, id, payload;
      std::int64_t first = 0, sequence = 0;
      int kind = 0;
      words >> what >> id;
      if (what == "created") created.insert(id);
      if (what == "error") errors += line + "\n";
      if (what != "saw") continue;
      words >> first >> sequence >> kind >> std::ws;
      std::getline(words, payload);
      // No number occurs twice, and none is missing without a gap.
      if (first != positions[id] + 1 || sequence < first)
        errors += "after " + std::to_string(positions[id]) + ": " + line + "\n";
      positions[id] = sequence;
      if (IsDurable(static_cast<EventKind>(kind))) durable[id].push_back(payload);
    }
  }
};

TEST(ManagerCrashTest, EveryJobEndsOnceWithTheSameBitsThroughAllLivesOfItsServer) {
  const testing::RandomKills kills(15);
  SCOPED_TRACE(kills.trace());
  testing::ShortLives lives(kills.seed, 5000, 120'000);
  const testing::TemporaryFolder folder;
  const std::string path = folder.File("jobs.db");
  Seen seen;
  for (int k = 0; k < kills.count && seen.errors.empty(); ++k) {
    seen.Read(lives.Next([&](int pipe) { Serve(path, pipe, seen.positions); }));
  }
  EXPECT_EQ(seen.errors, "");
  // The last life is not cut short.
  SqliteJobStore store({.path = path}, SystemClock());
  JobManager manager(Options(), store, &Cost, FakeSolve, SystemClock());
  int resumed = 0;
  for (const JobId& id : seen.created) {
    JobFollower follower(manager, id, {.after = seen.positions[id]});
    follower.ended = true;
    follower.Read();
    const auto job = store.Get("ada", id);
    ASSERT_TRUE(job.ok()) << job.status();
    EXPECT_EQ(job->state, JobState::kSucceeded) << job->error;
    EXPECT_EQ(Trajectory(store, id), Trajectory(kWindows));
    std::vector<std::string> durable = seen.durable[id];
    durable.insert(durable.end(), follower.durable.begin(), follower.durable.end());
    for (int window = 0; window < kWindows; ++window) {
      EXPECT_EQ(std::count(durable.begin(), durable.end(), "window " + std::to_string(window)), 1) << id;
    }
    EXPECT_EQ(std::count(durable.begin(), durable.end(), "SUCCEEDED"), 1);
    EXPECT_EQ(durable.back(), "solved");
    resumed += std::count(durable.begin(), durable.end(), "RUNNING") > 1;
  }
  RecordProperty("jobs", std::to_string(seen.created.size()));
  RecordProperty("resumed", std::to_string(resumed));
  EXPECT_GT(seen.created.size(), 3u);
}

}  // namespace
}  // namespace dlcs::jobs
