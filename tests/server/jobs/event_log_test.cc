// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/event_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <string>
#include <utility>

#include "tests/server/store/manual_clock.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using Got = EventWatch::Got;
using Why = EventGap::Why;

// A log whose numbers are reserved, and a store that records what it receives.
class EventLogTest : public ::testing::Test {
 protected:
  std::shared_ptr<EventLog> MakeLog(const EventLogLimits& limits = {}, std::int64_t archived_through = 0) {
    auto log = std::make_shared<EventLog>(limits, clock_, nullptr, archived_through);
    log->Reserve(1'000'000);
    return log;
  }
  std::unique_ptr<EventWatch> Watch(std::shared_ptr<EventLog> log, const EventWatchOptions& options = {}) {
    return std::make_unique<EventWatch>(std::move(log), options, [] {});
  }
  // Does what the writer of the store does.
  void Keep(EventLog& log, EventKind kind, const std::string& payload) {
    const std::int64_t sequence = log.Append(kind, payload).sequence;
    Archive(sequence, kind, payload);
    log.MarkStored(sequence);
  }
  void Archive(std::int64_t sequence, EventKind kind, const std::string& payload) {
    archive_.push_back({.sequence = sequence,
                        .time = clock_.Now(),
                        .kind = kind,
                        .payload = std::make_shared<const std::string>(payload)});
  }
  std::vector<Event> ReadArchive(std::int64_t after, std::size_t limit) const {
    std::vector<Event> page;
    for (const Event& event : archive_) {
      if (event.sequence > after && page.size() < limit) page.push_back(event);
    }
    return page;
  }
  // All events that are available now, as text: "7:payload", gaps as "[3-6 slow]".
  std::vector<std::string> Read(EventWatch& watch, std::size_t page = 3) const {
    std::vector<std::string> texts;
    for (;;) {
      const bool more = watch.has_more();
      EventWatch::Delivery delivery = watch.Next();
      EXPECT_EQ(more, delivery.got == Got::kEvent);
      if (delivery.gap.has_value()) texts.push_back(Text(*delivery.gap));
      switch (delivery.got) {
        case Got::kEvent:
          texts.push_back(std::to_string(delivery.event.sequence) + ":" + *delivery.event.payload);
          break;
        case Got::kArchived: {
          std::vector<Event> events = ReadArchive(watch.position(), page);
          const std::int64_t through = events.size() < page ? delivery.archived_through : events.back().sequence;
          watch.Supply(std::move(events), through);
          break;
        }
        case Got::kHeartbeat:
          texts.push_back("heartbeat");
          break;
        case Got::kNothing:
          return texts;
        case Got::kEnd:
          texts.push_back("end");
          return texts;
      }
    }
  }
  static std::string Text(const EventGap& gap) {
    const char* const why[] = {"interval", "slow", "not retained"};
    return "[" + std::to_string(gap.first) + "-" + std::to_string(gap.last) + " " + why[static_cast<int>(gap.why)] +
           "]";
  }

  testing::ManualClock clock_;
  std::vector<Event> archive_;
};

TEST_F(EventLogTest, DeliversEverythingInOrderToEveryWatcher) {
  const auto log = MakeLog();
  const auto early = Watch(log);
  EXPECT_THAT(Read(*early), ElementsAre());
  Keep(*log, EventKind::kState, "RUNNING");
  log->Append(EventKind::kIterate, "a");
  log->Append(EventKind::kIterate, "b");
  EXPECT_THAT(Read(*early), ElementsAre("1:RUNNING", "2:a", "3:b"));
  Keep(*log, EventKind::kSummary, "done");
  EXPECT_THAT(Read(*early), ElementsAre("4:done", "end"));
  const auto late = Watch(log, {.after = 2});
  EXPECT_THAT(Read(*late), ElementsAre("3:b", "4:done", "end"));
  const auto too_late = Watch(log, {.after = 4});
  EXPECT_THAT(Read(*too_late), ElementsAre("end"));
}

TEST_F(EventLogTest, NothingComesAfterTheSummary) {
  const auto log = MakeLog();
  Keep(*log, EventKind::kSummary, "done");
  EXPECT_TRUE(log->closed());
  EXPECT_EQ(log->Append(EventKind::kIterate, "late").sequence, 0);
  EXPECT_EQ(log->Append(EventKind::kSummary, "again").sequence, 0);
  EXPECT_EQ(log->last_sequence(), 1);
  EXPECT_THAT(Read(*Watch(log)), ElementsAre("1:done", "end"));
}

TEST_F(EventLogTest, ShowsNoNumberThatTheStoreHasNotReserved) {
  const auto log = std::make_shared<EventLog>(EventLogLimits{}, clock_, nullptr, 0);
  const auto watch = Watch(log);
  for (int k = 0; k < 5; ++k) log->Append(EventKind::kIterate, "i");
  EXPECT_THAT(Read(*watch), ElementsAre());
  EXPECT_GT(log->WantedReservation(), 1000);
  log->Reserve(3);
  EXPECT_THAT(Read(*watch), ElementsAre("1:i", "2:i", "3:i"));
  log->Reserve(100'000);
  EXPECT_EQ(log->WantedReservation(), 0);
  EXPECT_THAT(Read(*watch), ElementsAre("4:i", "5:i"));
}

TEST_F(EventLogTest, AsksForReservationsALogarithmicNumberOfTimes) {
  const auto log = std::make_shared<EventLog>(EventLogLimits{}, clock_, nullptr, 0);
  int asked = 0;
  for (int k = 0; k < 50'000; ++k) {
    log->Append(EventKind::kIterate, "");
    if (const std::int64_t wanted = log->WantedReservation(); wanted > 0) {
      ++asked;
      log->Reserve(wanted);
    }
  }
  EXPECT_LT(asked, 15);
}

TEST_F(EventLogTest, ShowsNothingFromAnEventOnThatTheStoreDoesNotHaveYet) {
  const auto log = MakeLog();
  const auto watch = Watch(log);
  log->Append(EventKind::kIterate, "a");
  const std::int64_t window = log->Append(EventKind::kWindowAccepted, "w").sequence;
  log->Append(EventKind::kIterate, "b");
  EXPECT_THAT(Read(*watch), ElementsAre("1:a"));
  log->MarkStored(window);
  EXPECT_THAT(Read(*watch), ElementsAre("2:w", "3:b"));
}

TEST_F(EventLogTest, ConflatesIteratesButNeverWindowsForAWatcherThatAskedForFewer) {
  const auto log = MakeLog();
  const auto watch = Watch(log, {.min_interval = 50ms});
  log->Append(EventKind::kIterate, "a");
  EXPECT_THAT(Read(*watch), ElementsAre("1:a"));
  log->Append(EventKind::kIterate, "b");
  log->Append(EventKind::kIterate, "c");
  EXPECT_THAT(Read(*watch), ElementsAre());
  clock_.Advance(50ms);
  log->Append(EventKind::kIterate, "d");
  EXPECT_THAT(Read(*watch), ElementsAre("[2-3 interval]", "4:d"));
  log->Append(EventKind::kIterate, "e");
  Keep(*log, EventKind::kWindowAccepted, "w");
  log->Append(EventKind::kIterate, "f");
  EXPECT_THAT(Read(*watch), ElementsAre("[5-5 interval]", "6:w"));
  Keep(*log, EventKind::kSummary, "done");
  EXPECT_THAT(Read(*watch), ElementsAre("[7-7 interval]", "8:done", "end"));
}

TEST_F(EventLogTest, TakesASlowWatcherToTheNewestIterate) {
  const auto log = MakeLog();
  const auto watch = Watch(log, {.max_backlog = 10});
  for (int k = 0; k < 10; ++k) log->Append(EventKind::kIterate, "i");
  EXPECT_EQ(watch->Next().event.sequence, 1);
  for (int k = 0; k < 5; ++k) log->Append(EventKind::kIterate, "i");
  EXPECT_THAT(Read(*watch), ElementsAre("[2-14 slow]", "15:i"));
}

TEST_F(EventLogTest, StaysWithinItsLimitsAndSaysWhatItForgot) {
  const EventLogLimits limits{.max_events = 100, .max_bytes = 1 << 20};
  const auto log = MakeLog(limits);
  const auto stalled = Watch(log);
  std::size_t most = 0;
  for (int window = 0; window < 1000; ++window) {
    for (int k = 0; k < 20; ++k) log->Append(EventKind::kIterate, "i");
    Keep(*log, EventKind::kWindowAccepted, "w");
    most = std::max(most, log->num_events());
  }
  Keep(*log, EventKind::kSummary, "done");
  EXPECT_LE(most, 100u);
  EXPECT_LE(log->num_events(), 100u);
  // The iterates are lost and reported as a gap; every window is delivered.
  const std::vector<std::string> texts = Read(*stalled, 64);
  EXPECT_EQ(std::count_if(texts.begin(), texts.end(), [](const auto& text) { return text.ends_with(":w"); }), 1000);
  EXPECT_EQ(texts[0], "[1-20 not retained]");
  EXPECT_EQ(texts[1], "21:w");
  EXPECT_EQ(texts.back(), "end");
  EXPECT_EQ(texts[texts.size() - 2], "21001:done");
}

TEST_F(EventLogTest, BoundsBytesButKeepsTheNewestIterate) {
  const auto log = MakeLog({.max_events = 1000, .max_bytes = 100'000});
  for (int k = 0; k < 1000; ++k) {
    log->Append(EventKind::kIterate, std::string(k % 2 == 0 ? 300 : 20'000, 'x'));
    EXPECT_LE(log->num_bytes(), 100'000u);
  }
  log->Append(EventKind::kIterate, std::string(500'000, 'x'));
  EXPECT_EQ(log->num_events(), 1u);
  const auto watch = Watch(log);
  EXPECT_EQ(watch->Next().event.sequence, 1001);
}

TEST_F(EventLogTest, HoldsDurableEventsUntilTheStoreHasThem) {
  const auto log = MakeLog({.max_events = 10, .max_bytes = 1 << 20});
  for (int k = 0; k < 50; ++k) {
    Archive(log->Append(EventKind::kWindowAccepted, "w").sequence, EventKind::kWindowAccepted, "w");
  }
  EXPECT_EQ(log->num_events(), 50u);  // the store is behind, so nothing may be dropped
  log->MarkStored(50);
  EXPECT_LE(log->num_events(), 10u);
  EXPECT_EQ(Read(*Watch(log)).size(), 50u);
}

TEST_F(EventLogTest, GoesOnAboveTheStoresMarkAfterARestart) {
  Archive(1, EventKind::kState, "QUEUED");
  Archive(2, EventKind::kState, "RUNNING");
  Archive(7, EventKind::kWindowAccepted, "w");
  Archive(4097, EventKind::kState, "RUNNING");
  const auto log = MakeLog({}, 4097);
  EXPECT_EQ(log->Append(EventKind::kIterate, "i").sequence, 4098);
  EXPECT_THAT(Read(*Watch(log, {.after = 5})),
              ElementsAre("[6-6 not retained]", "7:w", "[8-4096 not retained]", "4097:RUNNING", "4098:i"));
}

TEST_F(EventLogTest, FollowsWhatOthersWroteIntoTheStore) {
  const auto log = MakeLog({}, 1);
  Archive(1, EventKind::kState, "QUEUED");
  const auto watch = Watch(log);
  EXPECT_THAT(Read(*watch), ElementsAre("1:QUEUED"));
  Archive(2, EventKind::kState, "CANCELLED");
  Archive(3, EventKind::kSummary, "");
  log->AdvanceArchive(3, true);
  EXPECT_THAT(Read(*watch), ElementsAre("2:CANCELLED", "3:", "end"));
}

TEST_F(EventLogTest, ForgetsWhatNobodySawWhenSomebodyElseGoesOn) {
  const auto log = std::make_shared<EventLog>(EventLogLimits{}, clock_, nullptr, 0);
  const auto watch = Watch(log);
  log->Reserve(3);
  for (const char* text : {"a", "b", "c", "d", "e"}) log->Append(EventKind::kIterate, text);
  EXPECT_THAT(Read(*watch), ElementsAre("1:a", "2:b", "3:c"));
  log->Append(EventKind::kSummary, "never stored");
  log->Abandon();
  EXPECT_THAT(Read(*watch), ElementsAre());
  Archive(4, EventKind::kState, "RUNNING");  // elsewhere, above the mark
  Archive(9, EventKind::kSummary, "done");
  log->AdvanceArchive(9, true);
  EXPECT_THAT(Read(*watch), ElementsAre("4:RUNNING", "[5-8 not retained]", "9:done", "end"));
}

TEST_F(EventLogTest, HeartbeatsFillSilenceAtMostFifteenSecondsLong) {
  const auto log = MakeLog();
  const auto often = Watch(log, {.heartbeat = 5s});
  const auto seldom = Watch(log, {.heartbeat = 1h});
  log->Append(EventKind::kIterate, "a");
  EXPECT_THAT(Read(*often), ElementsAre("1:a"));
  EXPECT_THAT(Read(*seldom), ElementsAre("1:a"));
  clock_.Advance(4999ms);
  EXPECT_THAT(Read(*often), ElementsAre());
  clock_.Advance(1ms);
  EXPECT_THAT(Read(*often), ElementsAre("heartbeat"));
  EXPECT_THAT(Read(*seldom), ElementsAre());
  clock_.Advance(10s);
  EXPECT_THAT(Read(*seldom), ElementsAre("heartbeat"));
  EXPECT_EQ(seldom->position(), 1);
}

// Any mixture of appending, committing, reading and resuming: every number is delivered or announced once, durable ones
// are delivered, and the summary is last.
TEST_F(EventLogTest, IteratesDoNotSilenceOneWhoWantsOnlyDurableEvents) {
  const auto log = MakeLog();
  const auto watch = Watch(log, {.durable_only = true});
  for (int second = 1; second <= 12; ++second) {
    clock_.Advance(1s);
    log->Append(EventKind::kIterate, "i");
    EXPECT_EQ(Read(*watch), std::vector<std::string>(second == 10 ? 1 : 0, "heartbeat")) << second;
  }
  Keep(*log, EventKind::kWindowAccepted, "w");
  log->Append(EventKind::kIterate, "i");
  Keep(*log, EventKind::kSummary, "s");
  EXPECT_THAT(Read(*watch), ElementsAre("13:w", "15:s", "end"));
}

TEST_F(EventLogTest, WakesNobodyForIteratesThatNobodyMayHaveYet) {
  class Counter final : public EventWaker {
   public:
    void Wake(std::shared_ptr<EventLog>) override { ++wakes; }
    int wakes = 0;
  } waker;
  const auto log = std::make_shared<EventLog>(EventLogLimits(), clock_, &waker, 0);
  log->Reserve(1'000'000);
  const auto watch = Watch(log, {.min_interval = 50ms});
  EXPECT_EQ(Read(*watch).size(), 0u);
  // Acts as the dispatcher: reads when it is woken, and at the time that it announced.
  int delivered = 0, seen = 0;
  Duration due = Duration::max();
  for (int k = 0; k < 1000; ++k) {
    clock_.Advance(1ms);
    log->Append(EventKind::kIterate, "i");
    if (waker.wakes == seen && clock_.Elapsed() < due) continue;
    seen = waker.wakes;
    std::vector<std::shared_ptr<const std::function<void()>>> ready;
    due = log->TakeReady(ready);
    if (!ready.empty()) delivered += static_cast<int>(Read(*watch).size());
  }
  EXPECT_GE(delivered, 20);  // with the gaps before them nearly twice as many
  EXPECT_LE(waker.wakes, 41);
}

TEST_F(EventLogTest, AccountsForEveryNumberWhateverHappens) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto chance = [&random](int percent) { return static_cast<int>(random() % 100) < percent; };
    archive_.clear();
    const auto log = MakeLog({.max_events = 5 + random() % 40, .max_bytes = 2000 + random() % 10'000});
    EventWatchOptions options{.min_interval = chance(50) ? Duration(3ms) : Duration(0),
                              .max_backlog = 1 + random() % 20};
    auto watch = Watch(log, options);
    std::map<std::int64_t, EventKind> appended;
    std::vector<std::pair<std::int64_t, EventKind>> uncommitted;
    std::int64_t next = 1;
    bool ended = false;
    const auto check = [&](const EventWatch::Delivery& delivery) {
      ASSERT_FALSE(ended);
      if (delivery.gap.has_value()) {
        ASSERT_EQ(delivery.gap->first, next);
        for (; next <= delivery.gap->last; ++next) ASSERT_FALSE(IsDurable(appended.at(next)));
      }
      ASSERT_EQ(delivery.event.sequence, next++);
      ASSERT_EQ(delivery.event.kind, appended.at(delivery.event.sequence));
      ended = delivery.event.kind == EventKind::kSummary;
    };
    const auto commit = [&] {
      for (const auto& [sequence, kind] : uncommitted) Archive(sequence, kind, "k");
      if (!uncommitted.empty()) log->MarkStored(uncommitted.back().first);
      uncommitted.clear();
    };
    for (int step = 0; step < 600; ++step) {
      clock_.Advance(Duration(random() % 2000));
      if (step == 599 || chance(50)) {
        const EventKind kind = step == 599  ? EventKind::kSummary
                               : chance(20) ? EventKind::kWindowAccepted
                                            : EventKind::kIterate;
        const std::int64_t sequence = log->Append(kind, std::string(random() % 300, 'p')).sequence;
        appended[sequence] = kind;
        if (IsDurable(kind)) uncommitted.emplace_back(sequence, kind);
      }
      if (chance(30)) commit();
      if (chance(2)) {  // the watcher loses its connection and reconnects
        options.after = watch->position();
        watch = Watch(log, options);
      }
      if (chance(40)) {
        EventWatch::Delivery delivery = watch->Next();
        if (delivery.got == Got::kEvent) check(delivery);
        if (delivery.got == Got::kArchived) {
          std::vector<Event> page = ReadArchive(watch->position(), 2);
          const std::int64_t through = page.size() < 2 ? delivery.archived_through : page.back().sequence;
          watch->Supply(std::move(page), through);
        }
      }
      ASSERT_FALSE(HasFatalFailure());
    }
    commit();
    for (EventWatch::Delivery delivery = watch->Next(); delivery.got != Got::kEnd; delivery = watch->Next()) {
      ASSERT_NE(delivery.got, Got::kNothing);
      if (delivery.got == Got::kEvent) check(delivery);
      if (delivery.got == Got::kArchived) {
        std::vector<Event> page = ReadArchive(watch->position(), 100);
        const std::int64_t through = page.size() < 100 ? delivery.archived_through : page.back().sequence;
        watch->Supply(std::move(page), through);
      }
      ASSERT_FALSE(HasFatalFailure());
    }
    EXPECT_TRUE(ended);
  }
}

TEST_F(EventLogTest, WantsWhatItsWatchersWantBetweenThem) {
  const auto log = MakeLog();
  EXPECT_EQ(*log->WantedDetail(), EventDetail());
  const auto plain = Watch(log);
  EXPECT_EQ(*log->WantedDetail(), EventDetail());
  auto coarse = Watch(log, {.detail = {.most_times = 5, .components = {0, 4}}});
  auto fine = Watch(log, {.detail = {.most_times = 9, .components = {2, 4}}});
  EXPECT_EQ(*log->WantedDetail(), (EventDetail{.most_times = 9, .components = {0, 2, 4}}));
  auto all = Watch(log, {.detail = {.most_times = 3, .components = {}}});
  EXPECT_EQ(*log->WantedDetail(), (EventDetail{.most_times = 9, .components = {}}));
  fine.reset();
  all.reset();
  EXPECT_EQ(*log->WantedDetail(), (EventDetail{.most_times = 5, .components = {0, 4}}));
  coarse.reset();
  EXPECT_EQ(*log->WantedDetail(), EventDetail());
}

// Another server runs the job and has sent some of its transient events.
TEST_F(EventLogTest, TakesWhatAnotherServerTells) {
  const auto transient = [this](std::int64_t sequence, const std::string& payload) {
    return Event{.sequence = sequence,
                 .time = clock_.Now(),
                 .kind = EventKind::kIterate,
                 .payload = std::make_shared<const std::string>(payload)};
  };
  Archive(1, EventKind::kState, "queued");
  const auto log = MakeLog({}, 1);
  const auto watch = Watch(log);
  EXPECT_THAT(Read(*watch), ElementsAre("1:queued"));
  // Arrives before the notice that there are further durable events.
  Archive(2, EventKind::kState, "running");
  Archive(3, EventKind::kAnalysis, "analysis");
  log->AppendRelayed(transient(5, "five"), 3);
  EXPECT_THAT(Read(*watch), ElementsAre("2:running", "3:analysis", "[4-4 not retained]", "5:five"));
  log->AdvanceArchive(3, false);  // late
  log->AppendRelayed(transient(5, "again"), 3);
  log->AppendRelayed(transient(4, "older"), 3);
  EXPECT_THAT(Read(*watch), ElementsAre());
  log->AppendRelayed(transient(9, "nine"), 3);
  log->AppendRelayed(transient(10, "ten"), 3);
  EXPECT_THAT(Read(*watch), ElementsAre("[6-8 not retained]", "9:nine", "10:ten"));
  Archive(12, EventKind::kSummary, "the end");
  log->AppendRelayed(transient(11, "eleven"), 3);
  log->AdvanceArchive(12, true);
  EXPECT_THAT(Read(*watch), ElementsAre("[11-11 not retained]", "12:the end", "end"));
  log->AppendRelayed(transient(13, "of a server that does not know"), 12);
  EXPECT_EQ(log->last_sequence(), 12);
}

TEST_F(EventLogTest, KnowsWhetherAnybodyWantsWhatPasses) {
  const auto log = MakeLog();
  EXPECT_FALSE(log->HasFullWatchers());
  const auto durable_only = Watch(log, {.durable_only = true});
  EXPECT_FALSE(log->HasFullWatchers());
  auto all = Watch(log);
  EXPECT_TRUE(log->HasFullWatchers());
  all.reset();
  EXPECT_FALSE(log->HasFullWatchers());
}

}  // namespace
}  // namespace dlcs::jobs
