// SPDX-License-Identifier: Apache-2.0
// A store whose database fails, and one that has recovered.

#ifndef DLCS_TESTS_SERVER_STORE_STORE_HEALTH_H_
#define DLCS_TESTS_SERVER_STORE_STORE_HEALTH_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/store/job_store.h"
#include "tests/server/store/job_samples.h"

namespace dlcs::jobs::testing {

// It fails with `code` and a message that contains `text`, and reports that it is not healthy.
inline void ExpectSick(JobStore& store, absl::StatusCode code, const std::string& text) {
  const absl::Status status = store.Create(SampleJob()).status();
  EXPECT_EQ(status.code(), code) << status;
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr(text));
  EXPECT_FALSE(store.Healthy());
  EXPECT_FALSE(store.Probe().ok());
  EXPECT_FALSE(store.Healthy());
}

// It has the jobs `ids` of "ada", and accepts new ones.
inline void ExpectWell(JobStore& store, const std::vector<JobId>& ids) {
  EXPECT_TRUE(store.Probe().ok()) << store.Probe();
  EXPECT_TRUE(store.Healthy());
  for (const JobId& id : ids) EXPECT_TRUE(store.Get("ada", id).ok()) << store.Get("ada", id).status();
  EXPECT_TRUE(store.Create(SampleJob()).ok());
}

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_STORE_HEALTH_H_
