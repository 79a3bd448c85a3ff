// SPDX-License-Identifier: Apache-2.0
// The SQLite store while its file is full, locked, damaged or missing, and afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/store/sqlite/sqlite.h"
#include "server/store/sqlite/sqlite_job_store.h"
#include "server/store/sqlite/sqlite_schema.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/manual_clock.h"
#include "tests/server/store/store_health.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using testing::ExpectSick;
using testing::ExpectWell;
using ::testing::HasSubstr;
using testing::SampleEnd;
using testing::SampleJob;
using testing::SampleWindow;

class SqliteFaultsTest : public ::testing::Test {
 protected:
  std::unique_ptr<SqliteJobStore> Open(SqliteDatabaseOptions options = {}) {
    options.path = path_;
    options.busy_timeout = 50ms;
    return std::make_unique<SqliteJobStore>(options, clock_);
  }
  // With this many jobs in it, closed.
  std::vector<JobId> FillFile(int num_jobs) {
    const auto store = Open();
    std::vector<JobId> ids;
    for (int k = 0; k < num_jobs; ++k) {
      ids.push_back(store->Create(SampleJob("ada", std::string(5000, 'b')))->job.id);
    }
    return ids;
  }

  testing::ManualClock clock_;
  testing::TemporaryFolder folder_;
  const std::string path_ = folder_.File("jobs.db");
};

TEST_F(SqliteFaultsTest, AFullStoreRefusesLosesNothingAndWorksAgainWhenThereIsRoom) {
  const auto store = Open({.path = {}, .max_bytes = 400'000});
  std::vector<JobId> ids;
  absl::Status status;
  while (status.ok()) {
    const auto created = store->Create(SampleJob("ada", std::string(20'000, 'b')));
    status = created.status();
    if (status.ok()) ids.push_back(created->job.id);
    ASSERT_LT(ids.size(), 30u);
  }
  EXPECT_GT(ids.size(), 5u);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("disk is full or its size limit is reached"));
  EXPECT_FALSE(store->Healthy());
  for (const JobId& id : ids) EXPECT_TRUE(store->Get("ada", id).ok());  // reading goes on
  // A checkpoint that does not fit leaves nothing of itself.
  const JobId first[] = {ids[0]};
  const auto claimed = store->Claim("w", 30s, first);
  if (claimed.ok()) {
    Progress large = SampleWindow(0, 10);
    large.chunks[0].data = std::string(200'000, 'c');
    EXPECT_EQ(store->Append((*claimed)->lease, large).code(), absl::StatusCode::kUnavailable);
    EXPECT_EQ(store->Get("ada", ids[0])->chunks, 0);
  }
  // Room is made while it runs.
  for (const JobId& id : {ids[1], ids[2], ids[3]}) {
    ASSERT_TRUE(store->RequestCancel("ada", id).ok());
    ASSERT_TRUE(store->Delete("ada", id).ok());
  }
  EXPECT_TRUE(store->Create(SampleJob("ada", std::string(20'000, 'b'))).ok());
  EXPECT_TRUE(store->Healthy());
}

TEST_F(SqliteFaultsTest, FreedPagesGoBackToTheDisk) {
  const auto store = Open();
  for (int k = 0; k < 20; ++k) {
    const auto created = store->Create(SampleJob("ada", std::string(100'000, 'b')));
    ASSERT_TRUE(store->RequestCancel("ada", created->job.id).ok());
  }
  const auto bytes = [this] {
    return std::stoll(SqliteConnection(path_, SqliteConnection::IfMissing::kFail, 1s).Query("PRAGMA page_count")) *
           4096;
  };
  EXPECT_GT(bytes(), 2'000'000);
  EXPECT_EQ(*store->Expire({.max_age = 1h, .max_finished_bytes = 0}), 20);
  EXPECT_LT(bytes(), 200'000);
}

TEST_F(SqliteFaultsTest, ALockedFileIsAnErrorUntilItIsFree) {
  const std::vector<JobId> ids = FillFile(3);
  const auto store = Open();
  EXPECT_TRUE(store->Probe().ok());
  {
    SqliteConnection intruder(path_, SqliteConnection::IfMissing::kFail, 1s);
    const SqliteTransaction transaction(intruder);
    ExpectSick(*store, absl::StatusCode::kUnavailable, "locked by another process");
    EXPECT_TRUE(store->Get("ada", ids[0]).ok());
  }
  ExpectWell(*store, ids);
}

TEST_F(SqliteFaultsTest, ALockThatIsShortIsWaitedFor) {
  FillFile(1);
  SqliteJobStore store({.path = path_, .busy_timeout = 5s}, clock_);
  SqliteConnection intruder(path_, SqliteConnection::IfMissing::kFail, 1s);
  auto transaction = std::make_unique<SqliteTransaction>(intruder);
  std::thread letting_go([&transaction] {
    std::this_thread::sleep_for(100ms);
    transaction.reset();
  });
  EXPECT_TRUE(store.Create(SampleJob()).ok());
  letting_go.join();
}

TEST_F(SqliteFaultsTest, GarbageIsSaidToBeDamagedAndACopyIsTakenUpAgain) {
  const std::vector<JobId> ids = FillFile(3);
  const std::string copy = folder_.File("copy.db");
  std::filesystem::copy_file(path_, copy);
  std::ofstream(path_, std::ios::trunc) << std::string(100'000, 'g');
  const auto store = Open();
  ExpectSick(*store, absl::StatusCode::kDataLoss, "damaged");
  EXPECT_FALSE(store->Get("ada", ids[0]).ok());
  // The damaged file is left unchanged for an inspection.
  EXPECT_EQ(std::filesystem::file_size(path_), 100'000u);
  std::filesystem::rename(copy, path_);
  ExpectWell(*store, ids);
}

TEST_F(SqliteFaultsTest, ATruncatedFileIsSaidToBeDamaged) {
  const std::vector<JobId> ids = FillFile(40);
  const std::string copy = folder_.File("copy.db");
  std::filesystem::copy_file(path_, copy);
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) / 2);
  const auto store = Open();
  ExpectSick(*store, absl::StatusCode::kDataLoss, "damaged");
  std::filesystem::rename(copy, path_);
  ExpectWell(*store, ids);
}

TEST_F(SqliteFaultsTest, ADeletedFolderIsNoticedAtOnceAndNeverReplacedByAnEmptyOne) {
  namespace fs = std::filesystem;
  const fs::path inner = folder_.path() / "inner";
  fs::create_directory(inner);
  SqliteJobStore store({.path = (inner / "jobs.db").string()}, clock_);
  const JobId id = store.Create(SampleJob())->job.id;
  ASSERT_TRUE(store.Get("ada", id).ok());

  const fs::path away = folder_.path() / "away";
  fs::rename(inner, away);
  ExpectSick(store, absl::StatusCode::kUnavailable, "missing");
  EXPECT_FALSE(store.Get("ada", id).ok());
  fs::create_directory(inner);
  ExpectSick(store, absl::StatusCode::kUnavailable, "missing");
  EXPECT_TRUE(fs::is_empty(inner));
  fs::remove(inner);
  fs::rename(away, inner);
  ExpectWell(store, {id});
}

TEST_F(SqliteFaultsTest, AFolderThatComesLaterIsTakenUp) {
  namespace fs = std::filesystem;
  const fs::path late = folder_.path() / "late";
  SqliteJobStore store({.path = (late / "jobs.db").string()}, clock_);
  EXPECT_FALSE(store.Healthy());
  ExpectSick(store, absl::StatusCode::kUnavailable, "cannot be opened");
  fs::create_directory(late);
  ExpectWell(store, {});
}

TEST_F(SqliteFaultsTest, ANewerDatabaseIsLeftAlone) {
  FillFile(1);
  SqliteConnection(path_, SqliteConnection::IfMissing::kFail, 1s).Execute("PRAGMA user_version = 1000");
  const auto store = Open();
  const absl::Status status = store->Create(SampleJob()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("schema version 1000"));
  EXPECT_FALSE(store->Healthy());
}

TEST_F(SqliteFaultsTest, MigrationsKeepTheRowsAndAFailedStepLeavesTheVersionBefore) {
  SqliteConnection connection(path_, SqliteConnection::IfMissing::kCreate, 1s);
  const char* const first[] = {"CREATE TABLE t (a INTEGER); INSERT INTO t VALUES (1)"};
  ASSERT_TRUE(Migrate(connection, first).ok());
  const char* const broken[] = {first[0], "ALTER TABLE t ADD COLUMN b INTEGER DEFAULT 7; SELECT nothing FROM nowhere"};
  EXPECT_THROW((void)Migrate(connection, broken), SqliteError);
  EXPECT_EQ(connection.Query("PRAGMA user_version"), "1");
  EXPECT_THROW(connection.Query("SELECT b FROM t"), SqliteError);
  const char* const mended[] = {first[0], "ALTER TABLE t ADD COLUMN b INTEGER DEFAULT 7",
                                "INSERT INTO t VALUES (2, 8)"};
  ASSERT_TRUE(Migrate(connection, mended).ok());
  ASSERT_TRUE(Migrate(connection, mended).ok());  // nothing left to do
  EXPECT_EQ(connection.Query("PRAGMA user_version"), "3");
  EXPECT_EQ(connection.Query("SELECT group_concat(a || ':' || b) FROM t"), "1:7,2:8");
}

TEST_F(SqliteFaultsTest, WhatWasWrittenIsInOneFileAfterAnOrderlyEnd) {
  const std::vector<JobId> ids = FillFile(10);
  EXPECT_TRUE(!std::filesystem::exists(path_ + "-wal") || std::filesystem::file_size(path_ + "-wal") == 0);
  ExpectWell(*Open(), ids);
}

}  // namespace
}  // namespace dlcs::jobs
