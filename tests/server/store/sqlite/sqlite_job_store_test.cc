// SPDX-License-Identifier: Apache-2.0
#include "server/store/sqlite/sqlite_job_store.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/server/store/job_store_contract.h"
#include "tests/server/store/manual_clock.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs::testing {
namespace {

class SharedSqliteStore final : public SharedStore {
 public:
  SharedSqliteStore()
      : one_({.path = folder_.File("jobs.db")}, clock_), other_({.path = folder_.File("jobs.db")}, clock_) {}
  JobStore& one() override { return one_; }
  JobStore& other() override { return other_; }
  ProblemStore& problems() override { return one_; }
  ProblemStore& other_problems() override { return other_; }
  void Advance(Duration duration) override { clock_.Advance(duration); }

 private:
  TemporaryFolder folder_;
  ManualClock clock_;
  SqliteJobStore one_;
  SqliteJobStore other_;
};

std::unique_ptr<SharedStore> MakeSqliteStores() { return std::make_unique<SharedSqliteStore>(); }

INSTANTIATE_TEST_SUITE_P(Sqlite, JobStoreContractTest, ::testing::Values(MakeSqliteStores));
INSTANTIATE_TEST_SUITE_P(Sqlite, ProblemStoreContractTest, ::testing::Values(MakeSqliteStores));

}  // namespace
}  // namespace dlcs::jobs::testing
