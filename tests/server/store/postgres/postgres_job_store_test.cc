// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_job_store.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/server/store/job_store_contract.h"
#include "tests/server/store/postgres/postgres_server.h"

namespace dlcs::jobs::testing {
namespace {

// A schema of its own in the shared database.
class SharedPostgresStore final : public SharedStore {
 public:
  SharedPostgresStore()
      : schema_("contract_" + std::to_string(++count_)),
        address_(PostgresServer::Shared().AddressOf(schema_)),
        one_({.address = address_}),
        other_({.address = address_}) {}
  ~SharedPostgresStore() override { PostgresServer::Shared().Execute("DROP SCHEMA " + schema_ + " CASCADE"); }
  JobStore& one() override { return one_; }
  JobStore& other() override { return other_; }
  ProblemStore& problems() override { return one_; }
  ProblemStore& other_problems() override { return other_; }
  // The store asks its own function for the time.
  void Advance(Duration duration) override {
    offset_ += duration;
    PostgresServer::Shared().Execute("CREATE OR REPLACE FUNCTION " + schema_ +
                                     ".dlcs_now() RETURNS BIGINT STABLE LANGUAGE sql AS "
                                     "'SELECT (extract(epoch FROM statement_timestamp()) * 1000000)::bigint + " +
                                     std::to_string(offset_.count()) + "'");
  }

 private:
  static inline int count_ = 0;
  const std::string schema_;
  const std::string address_;
  PostgresJobStore one_;
  PostgresJobStore other_;
  Duration offset_{0};
};

std::unique_ptr<SharedStore> MakePostgresStores() { return std::make_unique<SharedPostgresStore>(); }

INSTANTIATE_TEST_SUITE_P(Postgres, JobStoreContractTest, ::testing::Values(MakePostgresStores));
INSTANTIATE_TEST_SUITE_P(Postgres, ProblemStoreContractTest, ::testing::Values(MakePostgresStores));

}  // namespace
}  // namespace dlcs::jobs::testing
