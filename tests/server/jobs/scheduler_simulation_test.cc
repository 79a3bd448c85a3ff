// SPDX-License-Identifier: Apache-2.0
// Simulates days of service in milliseconds: how long users wait beside each other, and how much of its capacity a
// server uses under five times as much work as it can do.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "server/jobs/scheduler.h"
#include "tests/server/store/manual_clock.h"

namespace dlcs::jobs {
namespace {

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }
Duration FromSeconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

struct Arrival {
  double at = 0;  // seconds
  std::string owner;
  double predicted = 0;  // core-seconds
  double actual = 0;
  double allowed = 0;  // until its deadline; 0: none
};

struct Fate {
  Arrival arrival;
  std::optional<Refusal> refusal;
  bool unmeetable = false;  // taken out of the queue
  double started = -1;
  double ended = -1;
  double response() const { return ended - arrival.at; }
  bool in_time() const { return ended >= 0 && (arrival.allowed == 0 || response() <= arrival.allowed); }
};

// Runs until all is done. One thread a job.
std::vector<Fate> Simulate(const SchedulerLimits& limits, std::vector<Arrival> arrivals) {
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  testing::ManualClock clock;
  const double origin = Seconds(clock.Elapsed());
  Scheduler scheduler(limits, clock);
  std::vector<Fate> fates;
  for (const Arrival& arrival : arrivals) fates.push_back({.arrival = arrival, .refusal = std::nullopt});
  std::multimap<double, std::size_t> ends;  // of running jobs
  std::size_t next = 0;
  while (next < fates.size() || !ends.empty()) {
    const bool arrives = next < fates.size() && (ends.empty() || fates[next].arrival.at <= ends.begin()->first);
    const double now = arrives ? fates[next].arrival.at : ends.begin()->first;
    clock.Advance(std::max(Duration(0), FromSeconds(now - (Seconds(clock.Elapsed()) - origin))));
    if (arrives) {
      const Arrival& arrival = fates[next].arrival;
      Scheduler::Request request{.id = std::to_string(next),
                                 .owner = arrival.owner,
                                 .priority = 0,
                                 .demand = {.core_seconds = arrival.predicted, .memory_bytes = 1, .threads = 1},
                                 .deadline = std::nullopt};
      if (arrival.allowed > 0) request.deadline = clock.Now() + FromSeconds(arrival.allowed);
      fates[next].refusal = scheduler.Enqueue(request);
      ++next;
    } else {
      const std::size_t job = ends.begin()->second;
      ends.erase(ends.begin());
      fates[job].ended = now;
      scheduler.Finished(std::to_string(job), fates[job].arrival.actual);
    }
    for (const JobId& id : scheduler.TakeUnmeetable()) fates[std::stoul(id)].unmeetable = true;
    while (const auto start = scheduler.StartNext()) {
      Fate& fate = fates[std::stoul(start->id)];
      fate.started = now;
      ends.emplace(now + fate.arrival.actual, std::stoul(start->id));
    }
  }
  return fates;
}

double Quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size() - 1)))];
}

std::vector<double> Responses(const std::vector<Fate>& fates, const std::string& owner) {
  std::vector<double> responses;
  for (const Fate& fate : fates) {
    if (fate.arrival.owner == owner && fate.ended >= 0) responses.push_back(fate.response());
  }
  return responses;
}

TEST(SchedulerSimulationTest, ALightUserWaitsForAJobNotForAQueue) {
  std::vector<Arrival> arrivals;
  for (int k = 0; k < 400; ++k) arrivals.push_back({.at = 0, .owner = "heavy", .predicted = 2, .actual = 2});
  for (int k = 0; k < 100; ++k) {
    arrivals.push_back({.at = 1.03 + 3.7 * k, .owner = "light", .predicted = 0.5, .actual = 0.5});
  }
  const SchedulerLimits limits{.cores = 2, .max_queued_jobs_per_user = 1000};
  const std::vector<double> light = Responses(Simulate(limits, arrivals), "light");
  ASSERT_EQ(light.size(), 100u);
  // At most the rest of one running job and one turn of the other user: alone it takes 0.5 s.
  EXPECT_LE(Quantile(light, 1), 2 + 2 + 0.5);
  EXPECT_LE(Quantile(light, 0.5), 2 + 0.5);
  RecordProperty("light_p99_s", std::to_string(Quantile(light, 0.99)));
}

TEST(SchedulerSimulationTest, ALightUserWithSmallJobsWaitsForNothing) {
  std::vector<Arrival> arrivals;
  for (int k = 0; k < 100; ++k) arrivals.push_back({.at = 0, .owner = "heavy", .predicted = 20, .actual = 25});
  // A quarter of a core; predictions are half of what it takes.
  for (int k = 0; k < 200; ++k) {
    arrivals.push_back({.at = 1.03 + 3.7 * k, .owner = "light", .predicted = 0.45, .actual = 0.9});
  }
  const SchedulerLimits limits{.cores = 2, .max_queued_jobs_per_user = 1000, .burst_cores = 1};
  const std::vector<Fate> fates = Simulate(limits, arrivals);
  const std::vector<double> light = Responses(fates, "light");
  ASSERT_EQ(light.size(), 200u);
  EXPECT_NEAR(Quantile(light, 1), 0.9, 1e-3);
  // The light user takes nothing from the heavy one, who has all cores all the time.
  EXPECT_NEAR(Quantile(Responses(fates, "heavy"), 1), 100 * 25 / 2, 1e-3);
}

TEST(SchedulerSimulationTest, EveryoneWhoAlwaysWantsMoreGetsTheSame) {
  std::mt19937 random(7);
  std::vector<Arrival> arrivals;
  const std::map<std::string, double> sizes{{"ada", 0.2}, {"bob", 1}, {"cyd", 5}};
  for (const auto& [owner, size] : sizes) {
    std::exponential_distribution<double> actual(1 / size);
    for (double total = 0; total < 2000;) {
      const double cost = actual(random);
      arrivals.push_back({.at = 0, .owner = owner, .predicted = size, .actual = cost});
      total += cost;
    }
  }
  const SchedulerLimits limits{.cores = 3, .max_queued_jobs = 1 << 20, .max_queued_jobs_per_user = 1 << 20};
  std::map<std::string, double> served;
  for (const Fate& fate : Simulate(limits, arrivals)) {
    if (fate.started >= 0 && fate.ended <= 1000) served[fate.arrival.owner] += fate.arrival.actual;
  }
  // 3000 core-seconds in 1000 s; predictions are right on average only.
  for (const auto& [owner, core_seconds] : served) EXPECT_NEAR(core_seconds, 1000, 100) << owner;
}

struct Load {
  double factor = 5;  // of the capacity, by four users
  bool heavy = true;
};

std::vector<Arrival> OverloadAndALightUser(const Load& load, unsigned seed) {
  std::mt19937 random(seed);
  std::exponential_distribution<double> gap(load.factor * 2 / 0.5);  // 2 cores, 0.5 core-seconds a job
  std::lognormal_distribution<double> error(0, 0.2);
  std::vector<Arrival> arrivals;
  for (double at = 0; load.heavy && at < 60; at += gap(random)) {
    const double predicted = 0.25 + 0.5 * std::uniform_real_distribution<double>()(random);
    arrivals.push_back({.at = at,
                        .owner = "heavy" + std::to_string(random() % 4),
                        .predicted = predicted,
                        .actual = predicted * error(random),
                        .allowed = 10});
  }
  // A quarter of its share, 2 cores among five.
  for (int k = 0; k < 12; ++k) {
    arrivals.push_back({.at = 3 + 4.9 * k, .owner = "light", .predicted = 0.5, .actual = 0.5, .allowed = 10});
  }
  return arrivals;
}

TEST(SchedulerSimulationTest, FiveTimesTooMuchWorkLeavesGoodputAndTheLightUserAlone) {
  const SchedulerLimits limits{.cores = 2, .max_queued_core_seconds = 40};
  const double unloaded =
      Quantile(Responses(Simulate(limits, OverloadAndALightUser({.heavy = false}, 1)), "light"), 0.99);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Fate> fates = Simulate(limits, OverloadAndALightUser({}, seed));
    double useful = 0;
    double wasted = 0;
    int refused = 0;
    for (const Fate& fate : fates) {
      if (fate.refusal.has_value()) {
        ++refused;
        ASSERT_TRUE(fate.refusal->retry_after.has_value());
        EXPECT_GT(*fate.refusal->retry_after, Duration(0));
        EXPECT_LE(Seconds(*fate.refusal->retry_after), 60);
        EXPECT_NE(fate.arrival.owner, "light");
      } else if (fate.ended >= 0 && fate.ended <= 60) {
        (fate.in_time() ? useful : wasted) += fate.arrival.actual;
      }
    }
    EXPECT_GE(useful, 0.9 * 2 * 60);
    EXPECT_LE(wasted, 0.05 * 2 * 60);
    EXPECT_GT(refused, 500);
    const double light = Quantile(Responses(fates, "light"), 0.99);
    EXPECT_LE(light, 3 * unloaded);
    RecordProperty("goodput_percent_" + std::to_string(seed), std::to_string(useful / 1.2));
    RecordProperty("light_p99_over_unloaded_" + std::to_string(seed), std::to_string(light / unloaded));
  }
}

}  // namespace
}  // namespace dlcs::jobs
