// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/live_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string Shown(const LiveView::Settings& settings, const std::function<void(LiveView&)>& watch) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  {
    LiveView view(stream, settings);
    watch(view);
  }
  std::fclose(stream);
  const std::string shown(text, size);
  std::free(text);
  return shown;
}

v1::SolveEvent Iterate(int iteration) {
  v1::SolveEvent event;
  v1::Iterate& iterate = *event.mutable_iterate();
  iterate.set_iteration(iteration);
  iterate.set_change(1.5e-3);
  iterate.set_log10_bound(-12.34);
  iterate.set_lcp_residual(2e-16);
  return event;
}

v1::SolveEvent WindowFinished(double end, bool accepted) {
  v1::SolveEvent event;
  v1::WindowFinished& outcome = *event.mutable_window_finished();
  outcome.set_end(end);
  outcome.set_accepted(accepted);
  if (!accepted) outcome.set_reason("the iterates grew");
  return event;
}

TEST(LiveViewTest, TellsTheAnalysisAndWhoChoseTheError) {
  v1::SolveEvent event;
  v1::Analysis& analysis = *event.mutable_analysis();
  analysis.set_matrix_class("Z-matrix");
  analysis.set_method(v1::METHOD_TIME_STEPPING);
  analysis.set_reason("because");
  analysis.add_warnings("take care");
  const auto watch = [&](LiveView& view) { view.OnEvent(event); };
  EXPECT_THAT(Shown({.default_error = true}, watch),
              AllOf(HasSubstr("Z-matrix"), HasSubstr("time-stepping, steps for"), HasSubstr("1e-06"),
                    HasSubstr("--tolerance"), HasSubstr("warning: take care"), Not(HasSubstr("because"))));
  EXPECT_THAT(Shown({.default_error = false}, watch), Not(HasSubstr("--tolerance")));
  analysis.set_steps(1000);
  EXPECT_THAT(Shown({}, watch), HasSubstr("1000 steps"));
}

TEST(LiveViewTest, ShowsIteratesAsPlainLinesInALog) {
  const std::string shown = Shown({}, [](LiveView& view) {
    view.OnEvent(Iterate(1));
    view.OnEvent(Iterate(2));
  });
  EXPECT_THAT(shown, AllOf(HasSubstr("iteration"), HasSubstr("1.50e-03"), HasSubstr("10^-12.3"), HasSubstr("2.0e-16")));
  EXPECT_THAT(shown, AllOf(Not(HasSubstr("\r")), Not(HasSubstr("\x1b"))));
  EXPECT_EQ(std::count(shown.begin(), shown.end(), '\n'), 3);
}

TEST(LiveViewTest, CountsWhatItPassesOverAndShowsTheLastIterate) {
  const std::string shown = Shown({}, [](LiveView& view) {
    for (int i = 1; i <= 5000; ++i) view.OnEvent(Iterate(i));
  });
  EXPECT_LT(std::count(shown.begin(), shown.end(), '\n'), 200);
  EXPECT_THAT(shown, AllOf(::testing::ContainsRegex("49[0-9][0-9] iterates not shown"), HasSubstr(" 5000 ")));
}

TEST(LiveViewTest, CondensesToTheLastIterateOfAWindow) {
  const std::string shown = Shown({}, [](LiveView& view) {
    for (int i = 1; i <= 100; ++i) view.OnEvent(Iterate(i));
    view.OnEvent(WindowFinished(0.5, true));
    for (int i = 1; i <= 7; ++i) view.OnEvent(Iterate(i));
  });
  EXPECT_THAT(shown, AllOf(HasSubstr("from here on only the last iterate of some windows"), HasSubstr("  7  "),
                           HasSubstr("iterates not shown")));
}

TEST(LiveViewTest, AnnouncesIteratesThatTheServerLeftOut) {
  v1::SolveEvent gap;
  gap.mutable_gap()->set_iterates(17);
  EXPECT_THAT(Shown({},
                    [&](LiveView& view) {
                      view.OnEvent(gap);
                      view.OnEvent(Iterate(18));
                    }),
              HasSubstr("17 iterates not shown"));
}

TEST(LiveViewTest, SaysWhyAWindowWasNotAccepted) {
  EXPECT_THAT(Shown({}, [](LiveView& view) { view.OnEvent(WindowFinished(0.5, false)); }),
              AllOf(HasSubstr("0.5"), HasSubstr("the iterates grew")));
}

// What is shown until a panel is complete, and what is shown at the end.
std::string ShownWithAPanel(const LiveView::Settings& settings, const std::function<void(LiveView&)>& watch) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  std::FILE* const stream = fdopen(ends[1], "w");
  std::string shown;
  std::array<char, 512> block;
  const auto read_on = [&] {
    const ssize_t count = read(ends[0], block.data(), block.size());
    if (count > 0) shown.append(block.data(), static_cast<std::size_t>(count));
    return count > 0;
  };
  {
    LiveView view(stream, settings);
    watch(view);
    while (shown.find("\x1b[J") == std::string::npos) read_on();
  }
  std::fclose(stream);
  while (read_on()) continue;
  close(ends[0]);
  return shown;
}

TEST(LiveViewTest, DrawsAPanelOnATerminalAndTakesItAway) {
  const std::string shown = ShownWithAPanel({.terminal = true, .width = 80, .horizon = 2}, [](LiveView& view) {
    view.OnEvent(Iterate(1));
    view.OnEvent(WindowFinished(1, true));
  });
  EXPECT_THAT(shown, AllOf(HasSubstr("[###############...............]  50 %"), HasSubstr("t = 1 of 2")));
  EXPECT_THAT(shown, Not(HasSubstr("LCP resid")));
  EXPECT_EQ(shown.substr(shown.rfind('\r')), "\r\x1b[J");
}

TEST(LiveViewTest, ShowsIteratesAndRejectedWindowsOnATerminalWhereAskedTo) {
  const auto watch = [](LiveView& view) {
    view.OnEvent(Iterate(1));
    view.OnEvent(WindowFinished(0.5, false));
  };
  EXPECT_THAT(ShownWithAPanel({.terminal = true, .verbose = true}, watch),
              AllOf(HasSubstr("LCP resid"), HasSubstr("1.50e-03"), HasSubstr("not accepted up to t = 0.5")));
  EXPECT_THAT(ShownWithAPanel({.terminal = true}, watch),
              AllOf(Not(HasSubstr("LCP resid")), Not(HasSubstr("not accepted")), HasSubstr("1 window tried again")));
}

TEST(LiveViewTest, KeepsThePanelWithinTheTerminal) {
  const std::string shown =
      ShownWithAPanel({.terminal = true, .width = 20, .horizon = 2}, [](LiveView& view) { view.OnEvent(Iterate(1)); });
  for (std::size_t begin = shown.find('\r') + 1; begin < shown.size();) {
    const std::size_t end = shown.find("\x1b[K", begin);
    if (end == std::string::npos) break;
    EXPECT_LT(end - begin, 20U) << shown.substr(begin, end - begin);
    begin = end + 4;
  }
}

TEST(LineBudgetTest, LetsABurstThroughAndThenARate) {
  LineBudget budget(3, 2);
  const auto start = LineBudget::Clock::now();
  const auto taken = [&](std::chrono::milliseconds after) { return budget.Take(start + after); };
  using std::chrono_literals::operator""ms;
  EXPECT_TRUE(taken(0ms));
  EXPECT_TRUE(taken(0ms));
  EXPECT_TRUE(taken(0ms));
  EXPECT_FALSE(taken(100ms));
  EXPECT_TRUE(taken(600ms));
  EXPECT_FALSE(taken(700ms));
}

}  // namespace
}  // namespace dlcs::client
