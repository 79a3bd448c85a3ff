// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/solve_panel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/terminal/wrapped_text.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

v1::SolveEvent PanelIterate(int window, int iteration, double log10_change, double log10_bound) {
  v1::SolveEvent event;
  v1::Iterate& iterate = *event.mutable_iterate();
  iterate.set_window(window);
  iterate.set_iteration(iteration);
  iterate.set_change(std::pow(10, log10_change));
  iterate.set_log10_bound(log10_bound);
  return event;
}

v1::SolveEvent PanelWindowStarted(int window, int steps) {
  v1::SolveEvent event;
  event.mutable_window_started()->set_window(window);
  event.mutable_window_started()->set_steps(steps);
  return event;
}

v1::SolveEvent PanelWindowFinished(int window, double end, bool accepted) {
  v1::SolveEvent event;
  v1::WindowFinished& outcome = *event.mutable_window_finished();
  outcome.set_window(window);
  outcome.set_end(end);
  outcome.set_accepted(accepted);
  if (!accepted) outcome.set_reason("the iterates grew");
  return event;
}

v1::SolveEvent PanelAnalysis(v1::Method method, int steps) {
  v1::SolveEvent event;
  event.mutable_analysis()->set_method(method);
  event.mutable_analysis()->set_steps(steps);
  return event;
}

std::string PanelText(const SolvePanel::Settings& settings, const std::vector<v1::SolveEvent>& events, int width = 99) {
  SolvePanel panel(settings);
  for (const v1::SolveEvent& event : events) panel.OnEvent(event);
  return panel.Text(width);
}

TEST(SparklineTest, HasEightHeightsAndIsBlankWhereThereIsNoNumber) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Sparkline({0, 1, 2, 3, 4, 5, 6, 7, kNone, -100, 100}, 0, 7, true), "▁▂▃▄▅▆▇█ ▁█");
  EXPECT_EQ(Sparkline({0, 7, kNone, 3}, 0, 7, false), "_# =");
  EXPECT_EQ(Sparkline({}, 0, 7, true), "");
}

TEST(ChangeHistoryTest, ShowsAllIterationsInAnyNumberOfColumns) {
  ChangeHistory history;
  for (int k = 1; k <= 8; ++k) history.Add(PanelIterate(0, k, -k, 1 - k).iterate());
  const auto near = [](double value) { return ::testing::DoubleNear(value, 1e-9); };
  EXPECT_THAT(history.Changes(2), ElementsAre(near(-4), near(-8)));
  EXPECT_EQ(history.Changes(100).size(), 8U);
  EXPECT_THAT(history.Bounds(2), ElementsAre(-3, -7));
  for (int k = 9; k <= 100'000; ++k) history.Add(PanelIterate(0, k, -k / 1e4, 1).iterate());
  const std::vector<double> columns = history.Changes(10);
  ASSERT_EQ(columns.size(), 10U);
  for (int k = 1; k <= 10; ++k) EXPECT_NEAR(columns[k - 1], -k, 0.1) << k;
  EXPECT_EQ(history.last().iteration(), 100'000);
}

TEST(RateMeterTest, CountsOnlyTheLastSeconds) {
  const RateMeter::Clock::time_point start{};
  const auto after = [start](int seconds) { return start + std::chrono::seconds(seconds); };
  RateMeter meter(start);
  EXPECT_EQ(meter.Rate(after(0), 0), 0);
  EXPECT_EQ(meter.Rate(after(1), 10), 10);
  EXPECT_EQ(meter.Rate(after(2), 20), 10);
  for (int second = 3; second < 9; ++second) meter.Rate(after(second), 20);
  EXPECT_EQ(meter.Rate(after(9), 20), 0);
}

TEST(SolvePanelTest, ShowsTheChangeAndItsBoundOnOneScale) {
  std::vector<v1::SolveEvent> events = {PanelWindowStarted(3, 10)};
  for (int k = 1; k <= 8; ++k) events.push_back(PanelIterate(3, k, -k, -k));
  const std::string text = PanelText({.horizon = 2, .utf8 = true}, events);
  EXPECT_THAT(text, AllOf(HasSubstr("\nchange  █▇▆▅▄▃▂▁  1e-08"), HasSubstr("\nbound   █▇▆▅▄▃▂▁  10^-8.0")));
  EXPECT_THAT(text, AllOf(HasSubstr("window 3, iteration 8"), HasSubstr(" iterations/s"), Not(HasSubstr("\x1b"))));
  EXPECT_THAT(PanelText({.horizon = 2}, events), HasSubstr("\nchange  #%*+=-._  1e-08"));
  EXPECT_THAT(PanelText({.color = true}, events), AllOf(HasSubstr("\x1b[36m#"), HasSubstr("_\x1b[0m  1e-08")));
}

TEST(SolvePanelTest, ABoundFarAboveDoesNotFlattenTheChanges) {
  std::vector<v1::SolveEvent> events;
  for (int k = 1; k <= 8; ++k) events.push_back(PanelIterate(0, k, -k, 300));
  EXPECT_THAT(PanelText({.utf8 = true}, events), AllOf(HasSubstr("change  ▅▄▄▃▃▂▂▁"), HasSubstr("bound   ████████")));
}

TEST(SolvePanelTest, HasNoBoundWhereThereIsNone) {
  v1::SolveEvent event = PanelIterate(0, 1, -3, 0);
  event.mutable_iterate()->clear_log10_bound();
  event.mutable_iterate()->set_change(0);  // and no logarithm
  EXPECT_THAT(PanelText({}, {event}), AllOf(HasSubstr("change     0"), Not(HasSubstr("bound"))));
}

TEST(SolvePanelTest, KeepsTheLastWindowUntilTheNextIterates) {
  EXPECT_THAT(PanelText({}, {PanelIterate(0, 7, -3, -3), PanelWindowFinished(0, 0.5, true), PanelWindowStarted(1, 5)}),
              HasSubstr("change"));
}

TEST(SolvePanelTest, ShowsEarlierWindowsWhereThereIsRoom) {
  std::vector<v1::SolveEvent> events;
  for (int window = 0; window < 3; ++window) {
    events.push_back(PanelIterate(window, 1, 0, 0));
    events.push_back(PanelIterate(window, 2, -7, -7));
    events.push_back(PanelWindowFinished(window, 0.1 * (window + 1), true));
  }
  EXPECT_THAT(PanelText({.utf8 = true}, events), HasSubstr("\nchange  █▁ █▁ █▁  1e-07\nbound   █▁ █▁ █▁  10^-7.0"));
  events.push_back(PanelIterate(3, 1, 0, 0));
  EXPECT_THAT(PanelText({.utf8 = true}, events), HasSubstr("\nchange  █▁ █▁ █▁ █  1"));
  EXPECT_THAT(PanelText({.utf8 = true}, events, 8 + 10 + 3), HasSubstr("\nchange  ▁ █  1\n"));
}

TEST(SolvePanelTest, CountsRetriesAndSaysWhy) {
  EXPECT_THAT(PanelText({}, {PanelWindowFinished(0, 0.75, false), PanelWindowFinished(0, 0.5, false)}),
              HasSubstr("\n2 windows tried again; the last, up to t = 0.5: the iterates grew"));
}

TEST(SolvePanelTest, SaysWhatIsBeingDone) {
  EXPECT_THAT(PanelText({.horizon = 2}, {}), HasSubstr("analyzing"));
  EXPECT_THAT(PanelText({.horizon = 2}, {PanelAnalysis(v1::METHOD_EVENT_DRIVEN, 0)}), HasSubstr("setting up"));
  const std::string trial = PanelText({.horizon = 2}, {PanelAnalysis(v1::METHOD_TIME_STEPPING, 0),
                                                       PanelWindowStarted(0, 9), PanelWindowFinished(0, 1.9995, true)});
  EXPECT_THAT(trial, AllOf(HasSubstr("  99 %  "), HasSubstr("trying shorter steps"), Not(HasSubstr(" of 2"))));
  const std::vector<v1::SolveEvent> to_the_end = {PanelAnalysis(v1::METHOD_TIME_STEPPING, 100),
                                                  PanelWindowStarted(0, 100), PanelWindowFinished(0, 2, true)};
  EXPECT_THAT(PanelText({.horizon = 2, .estimates = true}, to_the_end),
              AllOf(HasSubstr(" 100 %  "), HasSubstr("estimating the error"), HasSubstr(" steps/s")));
  EXPECT_THAT(PanelText({.horizon = 2}, to_the_end), HasSubstr("checking the result"));
  v1::SolveEvent queued;
  queued.set_state(v1::JOB_STATE_QUEUED);
  EXPECT_THAT(PanelText({}, {queued}), HasSubstr("waiting in the server's queue"));
}

TEST(SolvePanelTest, KeepsEveryLineWithinAnyWidth) {
  std::vector<v1::SolveEvent> events = {PanelWindowFinished(3, 1.23456, false)};
  for (int k = 1; k <= 500; ++k) events.push_back(PanelIterate(4, k, -k / 50.0, -k / 60.0));
  for (int width = 1; width <= 200; ++width) {
    std::istringstream lines(PanelText({.horizon = 1234.5678, .utf8 = true}, events, width));
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count) {
      EXPECT_LE(LetterCount(line), static_cast<std::size_t>(width)) << line;
    }
    EXPECT_LE(count, 8);
  }
}

}  // namespace
}  // namespace dlcs::client
