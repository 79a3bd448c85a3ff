// SPDX-License-Identifier: Apache-2.0
// The PostgreSQL store while its server is down, hangs, is full, damaged or belongs to another program, and afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "server/store/postgres/postgres_job_store.h"
#include "server/store/postgres/postgres_schema.h"
#include "spdlog/sinks/ostream_sink.h"
#include "spdlog/spdlog.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/postgres/postgres_server.h"
#include "tests/server/store/store_health.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using ::testing::AnyOf;
using testing::ExpectSick;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::PostgresServer;
using testing::SampleEnd;
using testing::SampleJob;
using testing::SampleWindow;
using ::testing::ThrowsMessage;

// In a schema of the test's own. What the store writes into the log is kept.
class PostgresFaultsTest : public ::testing::Test {
 protected:
  PostgresFaultsTest() {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log_)));
  }
  ~PostgresFaultsTest() override {
    spdlog::set_default_logger(usual_log_);
    if (server_ == &PostgresServer::Shared()) server_->Execute("DROP SCHEMA IF EXISTS " + schema_ + " CASCADE");
  }
  // For tests that disturb the server, and so have one of their own.
  void UseAnotherServer() { server_ = (another_ = std::make_unique<PostgresServer>()).get(); }
  std::unique_ptr<PostgresJobStore> Open() {
    return std::make_unique<PostgresJobStore>(
        PostgresDatabaseOptions{.address = server_->AddressOf(schema_), .statement_timeout = 1s, .patience = 4s});
  }
  static std::vector<JobId> Fill(JobStore& store, int num_jobs) {
    std::vector<JobId> ids;
    for (int k = 0; k < num_jobs; ++k) {
      const auto created = store.Create(SampleJob("ada", std::string(5000, 'b')));
      EXPECT_TRUE(created.ok()) << created.status();
      if (created.ok()) ids.push_back(created->job.id);
    }
    return ids;
  }
  PostgresConnection ConnectionIn(const std::string& schema) {
    return PostgresConnection(server_->AddressOf(schema), 10s);
  }

  std::ostringstream log_;
  const std::shared_ptr<spdlog::logger> usual_log_ = spdlog::default_logger();
  const std::string schema_ = "faults";
  std::unique_ptr<PostgresServer> another_;
  PostgresServer* server_ = &PostgresServer::Shared();
};

// Within some seconds: connections are not tried again without end.
void ExpectWellSoon(JobStore& store, const std::vector<JobId>& ids) {
  for (int k = 0; k < 200 && !store.Probe().ok(); ++k) std::this_thread::sleep_for(50ms);
  testing::ExpectWell(store, ids);
}

TEST_F(PostgresFaultsTest, AServerThatIsStoppedOrKilledIsAnErrorUntilItIsBack) {
  UseAnotherServer();
  const auto store = Open();
  std::vector<JobId> ids = Fill(*store, 3);
  for (const bool killed : {false, true}) {
    killed ? server_->Kill() : server_->Stop();
    ExpectSick(*store, absl::StatusCode::kUnavailable, "The job store");
    EXPECT_EQ(store->Get("ada", ids[0]).status().code(), absl::StatusCode::kUnavailable);
    server_->Start();
    ExpectWellSoon(*store, ids);
  }
  EXPECT_THAT(log_.str(), HasSubstr("works again"));
}

TEST_F(PostgresFaultsTest, AServerThatComesLateIsTakenUp) {
  UseAnotherServer();
  const std::string address = server_->address();
  server_->Stop();
  PostgresJobStore store({.address = address, .patience = 2s});
  EXPECT_FALSE(store.Healthy());
  ExpectSick(store, absl::StatusCode::kUnavailable, "cannot be reached");
  server_->Start();
  ExpectWellSoon(store, {});
}

TEST_F(PostgresFaultsTest, AServerThatHangsIsGivenUpAfterAWhile) {
  UseAnotherServer();
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 3);
  const std::string address = server_->AddressOf(schema_);
  PostgresConnection session(address, 2s);
  server_->Freeze();
  // The store uses its session, or a new one while that session still notifies of the new jobs: hence two messages.
  ExpectSick(*store, absl::StatusCode::kUnavailable, "cannot be reached");
  EXPECT_THAT(log_.str(), AnyOf(HasSubstr("no response of the database server for 4 s"), HasSubstr("timeout expired")));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT([&] { session.Run("SELECT 1::text"); },
              ThrowsMessage<PostgresError>(HasSubstr("no response of the database server for 2 s")));
  EXPECT_THAT([&] { PostgresConnection(address, 2s); }, ThrowsMessage<PostgresError>(HasSubstr("timeout expired")));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 4s);
  server_->Thaw();
  ExpectWellSoon(*store, ids);
}

// Commits shall wait for these synchronous standbys from now on.
void WaitFor(const std::string& standbys, PostgresConnection& operators) {
  operators.Run("ALTER SYSTEM SET synchronous_standby_names = '" + standbys + "'");
  operators.Run("SELECT pg_reload_conf()::text");
  while (operators.Run("SHOW synchronous_standby_names").Bytes(0, 0) != standbys) std::this_thread::sleep_for(10ms);
}

// Cancelled, as by an operator, the wait ends with a warning and a commit that only this server has.
TEST_F(PostgresFaultsTest, WhatTheSynchronousStandbyDoesNotHaveIsNotAcknowledged) {
  UseAnotherServer();
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 1);
  PostgresConnection operators = ConnectionIn(schema_);
  WaitFor("elsewhere", operators);
  const auto cancel = [&] {
    return operators
        .Run(
            "SELECT pg_cancel_backend(pid)::text FROM pg_stat_activity WHERE wait_event = 'SyncRep'"
            " AND application_name = 'dlcsd'")
        .size();
  };
  absl::Status status;
  int cancelled = 0;
  // Commits wait from when the checkpointer has read the setting too, which no query shows. A session that notifies of
  // an earlier job may wait beside the one that creates this one.
  for (int attempt = 0; attempt < 100 && cancelled == 0; ++attempt) {
    std::atomic<bool> is_created = false;
    std::thread creating([&] {
      status = store->Create(SampleJob()).status();
      is_created = true;
    });
    while (!is_created) {
      std::this_thread::sleep_for(10ms);
      cancelled += cancel();
    }
    creating.join();
  }
  EXPECT_GE(cancelled, 1);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_THAT(log_.str(), HasSubstr("synchronous replication"));
  WaitFor("", operators);
  ExpectWellSoon(*store, ids);
}

// As on a primary that wakes up when its standby has taken its place: it does not know what has happened since.
TEST_F(PostgresFaultsTest, APrimaryWithoutItsStandbyIsNotBelieved) {
  UseAnotherServer();
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 1);
  PostgresConnection operators = ConnectionIn(schema_);
  WaitFor("elsewhere", operators);
  std::this_thread::sleep_for(1100ms);  // what was committed before is believed for a second
  EXPECT_EQ(store->Get("ada", ids[0]).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(store->Get("ada", NewJobId()).status().code(), absl::StatusCode::kUnavailable) << "it may exist elsewhere";
  const JobId none[] = {NewJobId()};
  EXPECT_EQ(store->RenewLease({.job = none[0], .worker = "w"}, 1s).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_FALSE(store->Healthy());
  WaitFor("", operators);
  ExpectWellSoon(*store, ids);
  EXPECT_EQ(store->Get("ada", NewJobId()).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(PostgresFaultsTest, SessionsThatWereEndedBetweenCallsAreNotNoticed) {
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 1);
  server_->Execute(
      "SELECT pg_terminate_backend(pid, 10000) FROM pg_stat_activity"
      " WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()");
  EXPECT_TRUE(store->Get("ada", ids[0]).ok());
  EXPECT_TRUE(store->Create(SampleJob()).ok());
}

TEST_F(PostgresFaultsTest, ALockOfAnotherProgramIsAnErrorUntilItIsFree) {
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 1);
  {
    PostgresConnection intruder = ConnectionIn(schema_);
    intruder.Execute("BEGIN; LOCK TABLE jobs, dlcs_schema IN EXCLUSIVE MODE");
    ExpectSick(*store, absl::StatusCode::kUnavailable, "locked by another program");
    EXPECT_TRUE(store->Get("ada", ids[0]).ok());
  }
  ExpectWellSoon(*store, ids);
}

TEST_F(PostgresFaultsTest, WhatTakesTooLongIsEnded) {
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 1);
  server_->Execute("ALTER FUNCTION faults.dlcs_now() RENAME TO dlcs_real_now");
  server_->Execute(
      "CREATE FUNCTION faults.dlcs_now() RETURNS BIGINT VOLATILE LANGUAGE sql AS"
      " 'SELECT faults.dlcs_real_now() FROM pg_sleep(3600)'");
  ExpectSick(*store, absl::StatusCode::kUnavailable, "took too long");
  server_->Execute("DROP FUNCTION faults.dlcs_now(); ALTER FUNCTION faults.dlcs_real_now() RENAME TO dlcs_now");
  ExpectWellSoon(*store, ids);
}

// A file system of a few megabytes is nothing that a test may make everywhere: a trigger raises what the server raises
// when it cannot write.
TEST_F(PostgresFaultsTest, AFullDiskRefusesAndLosesNothing) {
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 2);
  const JobId first[] = {ids[0]};
  const auto claimed = store->Claim("w", 30s, first);
  ASSERT_TRUE(claimed.ok());
  ASSERT_TRUE(store->Append((*claimed)->lease, SampleWindow(0, 10)).ok());
  server_->Execute(
      "CREATE FUNCTION faults.full() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"
      "  RAISE EXCEPTION 'could not extend file \"base/5/16384\": No space left on device' USING ERRCODE = '53100';"
      "END $$;"
      "CREATE TRIGGER full_chunks BEFORE INSERT ON faults.chunks FOR EACH ROW EXECUTE FUNCTION faults.full();"
      "CREATE TRIGGER full_bodies BEFORE INSERT ON faults.bodies FOR EACH ROW EXECUTE FUNCTION faults.full()");
  const absl::Status status = store->Append((*claimed)->lease, SampleWindow(1, 20));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("disk is full"));
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("base/5"))) << "users need not know files";
  EXPECT_THAT(log_.str(), HasSubstr("base/5")) << "the operator does";
  EXPECT_FALSE(store->Healthy());
  EXPECT_EQ(store->Create(SampleJob()).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(store->Get("ada", ids[0])->chunks, 1);
  server_->Execute("DROP TRIGGER full_chunks ON faults.chunks; DROP TRIGGER full_bodies ON faults.bodies");
  ASSERT_TRUE(store->Append((*claimed)->lease, SampleWindow(1, 20)).ok());
  ASSERT_TRUE(store->Finish((*claimed)->lease, SampleEnd(20)).ok());
  ExpectWellSoon(*store, ids);
}

TEST_F(PostgresFaultsTest, DamagedPagesAreSaidToBeDamagedAndACopyIsTakenUpAgain) {
  UseAnotherServer();
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 30);
  std::string file;
  {
    PostgresConnection connection = ConnectionIn(schema_);
    connection.Execute("CHECKPOINT");
    file = connection.Run("SELECT pg_relation_filepath('jobs')").Bytes(0, 0);
  }
  server_->Stop();
  const std::filesystem::path path = server_->data() / file;
  const std::filesystem::path copy = path.string() + ".copy";
  std::filesystem::copy_file(path, copy);
  {
    std::fstream page(path, std::ios::in | std::ios::out | std::ios::binary);
    page.seekp(4000);
    page << std::string(3000, 'g');
  }
  server_->Start();
  absl::Status status = store->Get("ada", ids[0]).status();
  for (int k = 0; k < 200 && absl::IsUnavailable(status); ++k) {  // tried again after a moment
    std::this_thread::sleep_for(50ms);
    status = store->Get("ada", ids[0]).status();
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("damaged"));
  EXPECT_FALSE(store->Healthy());
  server_->Stop();
  std::filesystem::copy_file(copy, path, std::filesystem::copy_options::overwrite_existing);
  server_->Start();
  ExpectWellSoon(*store, ids);
}

TEST_F(PostgresFaultsTest, TablesThatGoMissingAreNeverReplacedByEmptyOnes) {
  const auto store = Open();
  const std::vector<JobId> ids = Fill(*store, 1);
  server_->Execute("ALTER SCHEMA faults RENAME TO away; CREATE SCHEMA faults");
  ExpectSick(*store, absl::StatusCode::kUnavailable, "tables are missing");
  // With a new connection, too.
  server_->Execute(
      "SELECT pg_terminate_backend(pid, 10000) FROM pg_stat_activity"
      " WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()");
  ExpectSick(*store, absl::StatusCode::kUnavailable, "tables are missing");
  EXPECT_TRUE(ConnectionIn(schema_).Run("SELECT 1 FROM pg_tables WHERE schemaname = 'faults'").empty());
  server_->Execute("DROP SCHEMA faults; ALTER SCHEMA away RENAME TO faults");
  ExpectWellSoon(*store, ids);
}

TEST_F(PostgresFaultsTest, ANewerDatabaseIsLeftAlone) {
  Fill(*Open(), 1);
  server_->Execute("UPDATE faults.dlcs_schema SET version = 1000");
  const auto store = Open();
  const absl::Status status = store->Create(SampleJob()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("schema version 1000"));
  EXPECT_FALSE(store->Healthy());
}

TEST_F(PostgresFaultsTest, AUserWithoutRightsIsToldSo) {
  Fill(*Open(), 1);
  server_->Execute(
      "CREATE ROLE guest LOGIN; GRANT USAGE ON SCHEMA faults TO guest;"
      "GRANT SELECT ON ALL TABLES IN SCHEMA faults TO guest");
  PostgresJobStore store({.address = server_->AddressOf(schema_) + "&user=guest"});
  ExpectSick(store, absl::StatusCode::kUnavailable, "lacks the rights");
  server_->Execute("DROP OWNED BY guest; DROP ROLE guest");
}

TEST_F(PostgresFaultsTest, PasswordsAreNeverRepeated) {
  for (const std::string host : {"127.0.0.1:1", "no-such-host.invalid", "%2Ftmp"}) {
    PostgresJobStore store({.address = "postgresql://dlcs:hunter2@" + host + "/postgres", .patience = 2s});
    const absl::Status status = store.Probe();
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
    EXPECT_THAT(status.ToString(), Not(HasSubstr("hunter2")));
  }
  EXPECT_THAT(log_.str(), HasSubstr("127.0.0.1"));
  EXPECT_THAT(log_.str(), Not(HasSubstr("hunter2")));
}

TEST_F(PostgresFaultsTest, MigrationsKeepTheRowsAndAFailedStepLeavesTheVersionBefore) {
  PostgresConnection connection = ConnectionIn("migrations");
  const PostgresMigration first[] = {{"CREATE TABLE t (a BIGINT); INSERT INTO t VALUES (1)"}};
  ASSERT_TRUE(Migrate(connection, first, IfMissing::kCreate).ok());
  const PostgresMigration broken[] = {first[0],
                                      {"ALTER TABLE t ADD COLUMN b BIGINT DEFAULT 7; SELECT nothing FROM nowhere"}};
  EXPECT_THROW((void)Migrate(connection, broken, IfMissing::kCreate), PostgresError);
  EXPECT_EQ(connection.Run("SELECT version FROM dlcs_schema").Int(0, 0), 1);
  EXPECT_THROW(connection.Run("SELECT b FROM t"), PostgresError);
  const PostgresMigration mended[] = {
      first[0], {"ALTER TABLE t ADD COLUMN b BIGINT DEFAULT 7"}, {"INSERT INTO t VALUES (2, 8)"}};
  ASSERT_TRUE(Migrate(connection, mended, IfMissing::kFail).ok());
  ASSERT_TRUE(Migrate(connection, mended, IfMissing::kFail).ok());  // nothing left to do
  EXPECT_EQ(connection.Run("SELECT version FROM dlcs_schema").Int(0, 0), 3);
  EXPECT_EQ(connection.Run("SELECT string_agg(a || ':' || b, ',' ORDER BY a) FROM t").Bytes(0, 0), "1:7,2:8");
}

TEST_F(PostgresFaultsTest, OlderServersGoOnAsLongAsAllStepsBearThem) {
  PostgresConnection connection = ConnectionIn("upgrades");
  const PostgresMigration steps[] = {
      {"CREATE TABLE t (a BIGINT)"}, {"ALTER TABLE t ADD COLUMN b BIGINT", true}, {"ALTER TABLE t DROP COLUMN a"}};
  const auto program = [&](std::size_t knows) {
    return Migrate(connection, std::span(steps).first(knows), IfMissing::kCreate);
  };
  const auto version = [&](const char* column) {
    return connection.Run(std::string("SELECT ") + column + " FROM dlcs_schema").Int(0, 0);
  };
  ASSERT_TRUE(program(1).ok());
  connection.Execute("ALTER TABLE dlcs_schema DROP COLUMN done");  // as earlier programs have left it
  ASSERT_TRUE(program(1).ok());
  ASSERT_TRUE(program(2).ok());
  EXPECT_EQ(version("done"), 2);
  EXPECT_EQ(version("version"), 1);
  ASSERT_TRUE(program(1).ok());
  EXPECT_EQ(version("done"), 2);
  ASSERT_TRUE(program(3).ok());
  EXPECT_EQ(version("version"), 3);
  EXPECT_EQ(program(2).code(), absl::StatusCode::kFailedPrecondition);

  // A new database is for programs that know all of it.
  PostgresConnection other = ConnectionIn("upgrades_anew");
  ASSERT_TRUE(Migrate(other, std::span(steps).first(2), IfMissing::kCreate).ok());
  EXPECT_EQ(Migrate(other, std::span(steps).first(1), IfMissing::kCreate).code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(PostgresFaultsTest, AStoreWhoseTablesNotifiedIsTakenUp) {
  PostgresConnection connection = ConnectionIn(schema_);
  ASSERT_TRUE(Migrate(connection, PostgresMigrations().first(4), IfMissing::kCreate).ok());
  connection.Execute(
      "INSERT INTO jobs (id, owner, request_id, body_hash, priority, core_seconds, memory_bytes, threads, state,"
      " created, stored_bytes) VALUES ('abcdefghijklmnopqrstuvwxyz', 'ada', '', '', 0, 1, 1, 1, 1, 5, 1);"
      "INSERT INTO bodies SELECT number, 'body' FROM jobs");
  connection.Execute("LISTEN dlcs_jobs");  // not in the transaction whose trigger notifies
  EXPECT_EQ(connection.TakeNotifications().size(), 0u);
  const auto store = Open();
  const JobId old[] = {"abcdefghijklmnopqrstuvwxyz"};
  const auto claimed = store->Claim("w", 30s, old);
  ASSERT_TRUE(claimed.ok() && claimed->has_value()) << claimed.status();
  EXPECT_EQ((*claimed)->body, "body");
  ASSERT_TRUE(store->Append((*claimed)->lease, SampleWindow(0, 10)).ok());
  ASSERT_TRUE(store->Finish((*claimed)->lease, SampleEnd(20)).ok());
  EXPECT_EQ(*store->Expire({.max_finished_bytes = 0}), 1);
  EXPECT_EQ(connection.Run("SELECT done FROM dlcs_schema").Int(0, 0), 5);
  EXPECT_EQ(connection.TakeNotifications().size(), 0u) << "in the transaction of a claim, a window or an end";
}

TEST_F(PostgresFaultsTest, ServersThatStartTogetherMakeTheTablesOnce) {
  std::vector<std::unique_ptr<PostgresJobStore>> stores;
  for (int k = 0; k < 6; ++k) stores.push_back(Open());
  std::vector<absl::Status> statuses(stores.size());
  std::vector<std::thread> starting;
  for (std::size_t k = 0; k < stores.size(); ++k) {
    starting.emplace_back([&, k] { statuses[k] = stores[k]->Probe(); });
  }
  for (std::thread& thread : starting) thread.join();
  for (const absl::Status& status : statuses) EXPECT_TRUE(status.ok()) << status;
}

TEST_F(PostgresFaultsTest, ManyCallsAtOnceShareTheConnections) {
  PostgresJobStore store({.address = server_->AddressOf(schema_), .max_connections = 2});
  std::vector<std::thread> callers;
  std::atomic<int> created = 0;
  for (int k = 0; k < 16; ++k) {
    callers.emplace_back([&] {
      for (int i = 0; i < 5; ++i) created += store.Create(SampleJob()).ok();
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(created, 80);
  const auto connections = [&] {
    return ConnectionIn(schema_)
        .Run("SELECT count(*) FROM pg_stat_activity WHERE application_name = 'dlcsd' AND pid <> pg_backend_pid()")
        .Int(0, 0);
  };
  // Those of stores that were there before take a moment to leave; the pool keeps what it has opened.
  for (int k = 0; k < 100 && connections() > 2; ++k) std::this_thread::sleep_for(50ms);
  EXPECT_LE(connections(), 2);
}

}  // namespace
}  // namespace dlcs::jobs
