// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_notice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "server/store/postgres/postgres_schema.h"

namespace dlcs::jobs {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

const JobId kJob = "abcdefghijklmnopqrstuvwxyz";

JobChange Transient(std::string payload) {
  return {.what = JobChange::What::kTransient,
          .job = kJob,
          .event = {.sequence = 70,
                    .time = Time(Duration(1'700'000'000'123'456)),
                    .kind = EventKind::kIterate,
                    .payload = std::make_shared<const std::string>(std::move(payload))},
          .durable_before = 65};
}

TEST(PostgresNoticeTest, TellsWhatPassesWhateverItsSize) {
  std::string bytes;
  for (int k = 0; k < 50'000; ++k) bytes += static_cast<char>(k * k);
  for (const std::string& payload : {std::string(), std::string(1, 0), std::string("x"), bytes}) {
    const std::vector<std::string> notices = NoticesOf(Transient(payload));
    NoticeReader reader;
    for (std::size_t k = 0; k < notices.size(); ++k) {
      EXPECT_LT(notices[k].size(), 8000u);
      const auto change = reader.Read(notices[k]);
      ASSERT_EQ(change.has_value(), k + 1 == notices.size());
      if (!change) continue;
      EXPECT_EQ(change->what, JobChange::What::kTransient);
      EXPECT_EQ(change->job, kJob);
      EXPECT_EQ(change->event.sequence, 70);
      EXPECT_EQ(change->event.time, Time(Duration(1'700'000'000'123'456)));
      EXPECT_EQ(change->event.kind, EventKind::kIterate);
      EXPECT_EQ(*change->event.payload, payload);
      EXPECT_EQ(change->durable_before, 65);
    }
  }
  EXPECT_THAT(NoticesOf(Transient(std::string(3'000'000, 'x'))), SizeIs(0));
}

TEST(PostgresNoticeTest, LeavesOutWhatItHeardInPart) {
  const std::vector<std::string> notices = NoticesOf(Transient(std::string(20'000, 'x')));
  ASSERT_EQ(notices.size(), 4u);
  NoticeReader reader;
  EXPECT_FALSE(reader.Read(notices[2]));
  EXPECT_FALSE(reader.Read(notices[3]));
  EXPECT_FALSE(reader.Read(notices[0]));
  EXPECT_FALSE(reader.Read(notices[2]));
  EXPECT_FALSE(reader.Read(notices[3]));
  for (const std::string& notice : notices) {
    EXPECT_EQ(reader.Read(notice).has_value(), &notice == &notices.back());
  }
}

TEST(PostgresNoticeTest, TellsWhatIsFollowed) {
  const std::vector<std::string> notices = NoticesOf({.what = JobChange::What::kFollowed, .job = kJob});
  ASSERT_THAT(notices, SizeIs(1));
  const auto change = NoticeReader().Read(notices[0]);
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(change->what, JobChange::What::kFollowed);
  EXPECT_EQ(change->job, kJob);
}

TEST(PostgresNoticeTest, TellsWhatIsWanted) {
  for (const EventDetail& detail : {EventDetail(), EventDetail{.most_times = 65, .components = {0, 2}},
                                    EventDetail{.most_times = ~std::size_t{0}, .components = {}}}) {
    const auto notices = NoticesOf({.what = JobChange::What::kWatched, .job = kJob, .detail = detail});
    ASSERT_THAT(notices, SizeIs(1));
    const auto change = NoticeReader().Read(notices.front());
    ASSERT_TRUE(change.has_value());
    EXPECT_EQ(change->what, JobChange::What::kWatched);
    EXPECT_EQ(change->job, kJob);
    EXPECT_EQ(change->detail, detail);
  }
}

TEST(PostgresNoticeTest, ReadsWhatTheDatabaseTellsAndNothingElse) {
  NoticeReader reader;
  EXPECT_EQ(reader.Read(std::string(1, kPostgresQueued) + kJob)->what, JobChange::What::kClaimable);
  EXPECT_EQ(reader.Read(std::string(1, kPostgresEvents) + kJob)->what, JobChange::What::kEvents);
  EXPECT_EQ(reader.Read(std::string(1, kPostgresCancelling) + kJob)->what, JobChange::What::kCancelling);
  for (const std::string& text :
       {std::string(), std::string("q"), "q" + kJob.substr(1), "?" + kJob, "w" + kJob, "w" + kJob + " x 1",
        "w" + kJob + " 5 1,x", "p" + kJob, "p" + kJob + " 0 1", "p" + kJob + " 0 1 1 2 5 3",
        "p" + kJob + " 0 1 1 2 5 3 %", "p" + kJob + " 0 1 1 2 4 3 eA==", "p" + kJob + " 0 1 1 2 77 3 eA=="}) {
    EXPECT_FALSE(reader.Read(text)) << text;
  }
}

}  // namespace
}  // namespace dlcs::jobs
