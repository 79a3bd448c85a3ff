// SPDX-License-Identifier: Apache-2.0
// A database of an earlier program remains usable. version-1.db was made by a server with schema version 1, which was
// killed: one job had ended, one was running, one was queued.
#include "server/store/sqlite/sqlite_schema.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <vector>

#include "server/store/sqlite/sqlite_job_store.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/support/paths.h"

namespace dlcs::jobs::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class SqliteSchemaTest : public ::testing::Test {
 protected:
  SqliteSchemaTest() : path_(folder_.File("jobs.db")) {
    std::filesystem::copy_file(dlcs::testing::ProjectPath("tests/server/store/version-1.db"), path_);
  }

  std::string Query(const std::string& sql) const {
    return SqliteConnection(path_, SqliteConnection::IfMissing::kFail, 1s).Query(sql);
  }

  TemporaryFolder folder_;
  const std::string path_;
};

TEST_F(SqliteSchemaTest, Version1LosesNothing) {
  ASSERT_EQ(Query("PRAGMA user_version"), "1");
  SqliteJobStore store({.path = path_}, SystemClock());
  const auto page = store.List({.owner = std::nullopt, .states = {}}, 10, "");
  ASSERT_TRUE(page.ok()) << page.status();
  ASSERT_EQ(page->jobs.size(), 3u);
  EXPECT_EQ(Query("PRAGMA user_version"), "4");
  EXPECT_EQ(Query("PRAGMA integrity_check"), "ok");

  const Job& queued = page->jobs[0];
  const Job& running = page->jobs[1];
  const Job& ended = page->jobs[2];
  EXPECT_EQ(queued.state, JobState::kQueued);
  EXPECT_EQ(queued.request_id, "third");
  EXPECT_EQ(queued.priority, 3);
  EXPECT_EQ(running.state, JobState::kRunning);
  EXPECT_EQ(ended.state, JobState::kSucceeded);
  for (const Job& job : page->jobs) EXPECT_EQ(job.problem, "");

  std::vector<EventKind> kinds;
  const auto events = store.ReadEvents(ended.id, 0, 100);
  ASSERT_TRUE(events.ok()) << events.status();
  for (const Event& event : *events) kinds.push_back(event.kind);
  EXPECT_THAT(kinds, ElementsAre(EventKind::kState, EventKind::kState, EventKind::kAnalysis, EventKind::kWindowAccepted,
                                 EventKind::kState, EventKind::kSummary));
  EXPECT_EQ(store.ReadChunks(ended.id, 0, 1 << 20)->size(), 1u);

  // The worker that had the job claims it again at once, and finds the request.
  ASSERT_EQ(*store.ReleaseLeases("dlcsd"), 1);
  const JobId candidates[] = {running.id};
  const auto claimed = store.Claim("dlcsd", 30s, candidates);
  ASSERT_TRUE(claimed.ok() && claimed->has_value());
  EXPECT_GT((*claimed)->body.size(), 100u);
}

TEST_F(SqliteSchemaTest, Version1TakesProblemsNow) {
  SqliteJobStore store({.path = path_}, SystemClock());
  const ProblemId id(64, 'a');
  ASSERT_TRUE(store.AddProblem({.owner = "", .id = id, .about = "", .body = "a problem"}, {}).ok());
  NewJob job = SampleJob("");
  job.problem = id;
  ASSERT_TRUE(store.Create(job).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(store.DeleteProblem("", id)));
}

}  // namespace
}  // namespace dlcs::jobs::testing
