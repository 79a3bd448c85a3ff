// SPDX-License-Identifier: Apache-2.0
// kill -9 at random moments: everything acknowledged is stored once, with the same bytes.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include "server/store/sqlite/sqlite_job_store.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/random_kills.h"
#include "tests/server/store/short_life.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using testing::SampleEnd;
using testing::SampleJob;
using testing::SampleWindow;

constexpr int kWindowsPerJob = 5;

// A server: resumes the jobs of its earlier life, then creates and runs jobs, and writes a line to `pipe` for
// everything that the store acknowledged. Never returns.
[[noreturn]] void Serve(const std::string& path, int pipe) {
  const auto say = [pipe](const std::string& line) { testing::Say(pipe, line); };
  const auto must = [&say](const absl::Status& status) {
    if (status.ok()) return;
    say("error " + std::string(status.message()) + "\n");
    _exit(1);
  };
  SqliteJobStore store({.path = path}, SystemClock());
  must(store.ReleaseLeases("server").status());
  for (;;) {
    if (const auto waiting = store.ListClaimable(1); waiting.ok() && waiting->empty()) {
      const NewJob job = SampleJob();
      say("creating " + job.id + "\n");
      must(store.Create(job).status());
      say("created " + job.id + "\n");
    }
    const auto candidates = store.ListClaimable(1);
    must(candidates.status());
    const JobId id[] = {candidates->at(0).id};
    const auto claimed = store.Claim("server", 30s, id);
    must(claimed.status());
    const ClaimedJob& job = **claimed;
    std::int64_t sequence = job.job.sequence;
    for (std::int64_t k = job.job.chunks; k < kWindowsPerJob; ++k) {
      Progress window = SampleWindow(k, ++sequence);
      window.reserve_through = sequence + 100;
      must(store.Append(job.lease, window));
      say("window " + id[0] + " " + std::to_string(k) + " " + std::to_string(sequence) + "\n");
      sequence += 3;  // iterates that watchers saw
      say("shown " + id[0] + " - " + std::to_string(sequence) + "\n");
    }
    must(store.Finish(job.lease, SampleEnd(sequence)));
    say("finished " + id[0] + "\n");
  }
}

struct Acknowledged {
  std::set<JobId> created;
  std::map<JobId, std::map<std::int64_t, std::int64_t>> windows;  // number of the event by window
  std::map<JobId, std::int64_t> shown;                            // the highest number seen so far
  std::set<JobId> finished;
  std::string errors;

  void Read(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string what, id, window;
      std::int64_t sequence = 0;
      words >> what >> id >> window >> sequence;
      if (what == "created") created.insert(id);
      if (what == "finished") finished.insert(id);
      if (what == "error") errors += line + "\n";
      if (what == "window" || what == "shown") {
        if (sequence <= shown[id]) errors += "number " + std::to_string(sequence) + " of " + id + " used twice\n";
        shown[id] = sequence;
      }
      if (what == "window" && !windows[id].emplace(std::stoll(window), sequence).second) {
        errors += "window " + window + " of " + id + " acknowledged twice\n";
      }
    }
  }
};

void Check(JobStore& store, const Acknowledged& said) {
  EXPECT_EQ(said.errors, "");
  for (const JobId& id : said.created) EXPECT_TRUE(store.Get("ada", id).ok()) << id;
  for (const auto& [id, windows] : said.windows) {
    const auto chunks = store.ReadChunks(id, 0, 1 << 20);
    ASSERT_TRUE(chunks.ok());
    ASSERT_GE(chunks->size(), windows.size());
    for (const auto& [number, sequence] : windows) {
      EXPECT_EQ(chunks->at(static_cast<std::size_t>(number)).data, SampleWindow(number, sequence).chunks[0].data);
    }
    const auto events = store.ReadEvents(id, 0, 1000);
    ASSERT_TRUE(events.ok());
    std::map<std::int64_t, std::string> by_number;
    std::set<std::string> window_payloads;
    for (const Event& event : *events) {
      EXPECT_TRUE(by_number.emplace(event.sequence, *event.payload).second);
      if (event.kind == EventKind::kWindowAccepted) {
        EXPECT_TRUE(window_payloads.insert(*event.payload).second) << *event.payload << " accepted twice";
      }
    }
    for (const auto& [number, sequence] : windows) EXPECT_EQ(by_number[sequence], "window " + std::to_string(number));
    EXPECT_GE(store.Get("ada", id)->sequence, windows.rbegin()->second);
  }
  for (const JobId& id : said.finished) {
    EXPECT_EQ(store.Get("ada", id)->state, JobState::kSucceeded);
    EXPECT_EQ(store.ReadChunks(id, 0, 1 << 20)->size(), static_cast<std::size_t>(kWindowsPerJob));
  }
}

TEST(StoreCrashTest, LosesNothingAcknowledgedWhenKilledAtRandomMoments) {
  const testing::RandomKills kills(20);
  SCOPED_TRACE(kills.trace());
  testing::ShortLives lives(kills.seed, 1000, 80'000);
  const testing::TemporaryFolder folder;
  const std::string path = folder.File("jobs.db");
  Acknowledged said;
  for (int k = 0; k < kills.count; ++k) {
    said.Read(lives.Next([&path](int pipe) { Serve(path, pipe); }));
    SqliteJobStore store({.path = path}, SystemClock());
    Check(store, said);
    if (HasFailure()) return;
  }
  RecordProperty("created", std::to_string(said.created.size()));
  RecordProperty("finished", std::to_string(said.finished.size()));
  EXPECT_GT(said.created.size(), 3u);
}

}  // namespace
}  // namespace dlcs::jobs
