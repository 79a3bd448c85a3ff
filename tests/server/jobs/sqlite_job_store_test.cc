// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/sqlite_job_store.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/server/jobs/job_store_contract.h"
#include "tests/server/jobs/manual_clock.h"
#include "tests/server/jobs/temporary_folder.h"

namespace dlcs::jobs::testing {
namespace {

class SharedSqliteStore final : public SharedStore {
 public:
  SharedSqliteStore()
      : one_({.path = folder_.File("jobs.db")}, clock_), other_({.path = folder_.File("jobs.db")}, clock_) {}
  JobStore& one() override { return one_; }
  JobStore& other() override { return other_; }
  void Advance(Duration duration) override { clock_.Advance(duration); }

 private:
  TemporaryFolder folder_;
  ManualClock clock_;
  SqliteJobStore one_;
  SqliteJobStore other_;
};

INSTANTIATE_TEST_SUITE_P(Sqlite, JobStoreContractTest,
                         ::testing::Values([] { return std::make_unique<SharedSqliteStore>(); }));

}  // namespace
}  // namespace dlcs::jobs::testing
