// SPDX-License-Identifier: Apache-2.0
#include "server/access/user_quota.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dlcs {
namespace {

TEST(UserQuotaTest, EachUserHasAsManyAsAllowed) {
  UserQuota quota("max_watches_per_user", 2);
  auto first = quota.Take("alice");
  const auto second = quota.Take("alice");
  EXPECT_TRUE(first.ok());
  EXPECT_TRUE(second.ok());
  const auto third = quota.Take("alice");
  EXPECT_EQ(third.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(third.status().message()), ::testing::HasSubstr("max_watches_per_user = 2"));
  EXPECT_TRUE(quota.Take("bob").ok());
  first = absl::CancelledError();  // releases the ticket
  EXPECT_TRUE(quota.Take("alice").ok());
}

TEST(UserQuotaTest, TicketsMayOutliveTheQuota) {
  absl::StatusOr<UserQuota::Ticket> ticket;
  {
    UserQuota quota("limit", 1);
    ticket = quota.Take("");
  }
  EXPECT_TRUE(ticket.ok());
}

}  // namespace
}  // namespace dlcs
