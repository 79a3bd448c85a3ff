// SPDX-License-Identifier: Apache-2.0
// What every JobStore and every ProblemStore must do. An implementation instantiates the suites with a function that
// makes its stores:
//
//     INSTANTIATE_TEST_SUITE_P(Sqlite, JobStoreContractTest, ::testing::Values(MakeSqliteStores));
//     INSTANTIATE_TEST_SUITE_P(Sqlite, ProblemStoreContractTest, ::testing::Values(MakeSqliteStores));

#ifndef DLCS_TESTS_SERVER_STORE_JOB_STORE_CONTRACT_H_
#define DLCS_TESTS_SERVER_STORE_JOB_STORE_CONTRACT_H_

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "server/store/job_store.h"
#include "server/store/problem_store.h"

namespace dlcs::jobs::testing {

// One store, seen by two servers, with a clock that the test moves.
class SharedStore {
 public:
  virtual ~SharedStore() = default;
  virtual JobStore& one() = 0;
  virtual JobStore& other() = 0;
  virtual ProblemStore& problems() = 0;
  virtual ProblemStore& other_problems() = 0;
  virtual void Advance(Duration duration) = 0;
};

class JobStoreContractTest : public ::testing::TestWithParam<std::function<std::unique_ptr<SharedStore>()>> {
 protected:
  JobStoreContractTest() : shared_(GetParam()()), store_(shared_->one()) {}

  std::unique_ptr<SharedStore> shared_;
  JobStore& store_;
};

// Of problem_store_contract_test.cc.
class ProblemStoreContractTest : public JobStoreContractTest {
 protected:
  ProblemStoreContractTest() : problems_(shared_->problems()) {}

  ProblemStore& problems_;
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_JOB_STORE_CONTRACT_H_
