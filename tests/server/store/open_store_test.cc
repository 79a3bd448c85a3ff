// SPDX-License-Identifier: Apache-2.0
#include "server/store/open_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace dlcs::jobs {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(OpenStoreTest, TellsFilesFromDatabases) {
  EXPECT_TRUE(IsShared("postgresql://dlcs@db/jobs"));
  EXPECT_TRUE(IsShared("postgres:///jobs"));
  EXPECT_FALSE(IsShared("jobs.db"));
  EXPECT_FALSE(IsShared("postgresql.db"));
  EXPECT_TRUE(CheckStoreAddress("any file's@name?").ok());
}

TEST(OpenStoreTest, DescribesAnAddressWithoutItsPassword) {
  EXPECT_EQ(DescribeStore("jobs.db"), "jobs.db");
  EXPECT_EQ(DescribeStore("postgresql://dlcs:hunter2@db:5433/jobs?sslmode=require&sslpassword=hunter2"),
            "postgresql://dlcs@db:5433/jobs");
  EXPECT_EQ(DescribeStore("postgres://"), "postgresql://");
  EXPECT_EQ(DescribeStore("postgresql:///jobs?host=/run/postgresql&password=hunter2"),
            "postgresql:///run/postgresql/jobs");
  EXPECT_THAT(DescribeStore("postgresql://dlcs:hunter2%@db"), Not(HasSubstr("hunter2")));
}

TEST(OpenStoreTest, RefusesWhatCanBeReadInTwoWaysAndRepeatsNothing) {
  for (const std::string good : {"postgresql://dlcs:hunt%40er2@db/jobs", "postgresql://dlcs:hunt?er2@db/jobs",
                                 "postgresql://one,other:5433/jobs?target_session_attrs=read-write",
                                 "postgresql:///jobs?host=/run/postgresql&user=a@b", "postgresql://[::1]:5432/jobs"}) {
    EXPECT_TRUE(CheckStoreAddress(good).ok()) << good;
  }
  for (const std::string bad : {"postgresql://dlcs:hunt@er2@db/jobs", "postgresql://dlcs:hunt/er2@db/jobs",
                                "postgresql://dlcs:hunt?@er2@db/jobs", "postgresql://dlcs:hunt@x/er2@db/jobs",
                                "postgresql://dlcs:hunt%er2@db/jobs", "postgresql://db/jobs?hunter2=1"}) {
    const absl::Status status = CheckStoreAddress(bad);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad;
    EXPECT_THAT(std::string(status.message()), HasSubstr("%40"));
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("er2"))) << bad;
  }
}

}  // namespace
}  // namespace dlcs::jobs
