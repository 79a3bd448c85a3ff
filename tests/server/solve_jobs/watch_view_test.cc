// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/watch_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

v1::WatchSolveJobRequest Request(v1::WatchView view, const std::vector<int>& components = {}) {
  v1::WatchSolveJobRequest request;
  request.set_view(view);
  request.mutable_y_components()->Add(components.begin(), components.end());
  return request;
}

WatchView View(v1::WatchView view, const std::vector<int>& components = {}) {
  return WatchView::Create(Request(view, components)).value();
}

// y_i(t_j) = 100 i + j at t_j = j / 10.
class WatchViewTest : public ::testing::Test {
 protected:
  v1::Iterate Told(const jobs::EventDetail& detail, Index n = 3, Index count = 131) const {
    std::vector<double> times;
    Matrix y(n, count);
    for (Index j = 0; j < count; ++j) {
      times.push_back(static_cast<double>(j) / 10);
      for (Index i = 0; i < n; ++i) y(i, j) = static_cast<double>(100 * i + j);
    }
    v1::SolveEvent event;
    event.mutable_iterate()->set_change(1);
    std::string bytes = event.SerializeAsString();
    AppendValues({times, y}, detail, bytes);
    EXPECT_TRUE(event.ParseFromString(bytes));
    return event.iterate();
  }
  v1::Iterate Narrowed(const WatchView& view, v1::Iterate iterate) const {
    view.Narrow(iterate);
    return iterate;
  }
};

TEST_F(WatchViewTest, GivesEachWatcherWhatItAskedFor) {
  const WatchView sampled = View(v1::WATCH_VIEW_SAMPLED), full = View(v1::WATCH_VIEW_FULL, {2, 0, 2});
  const v1::Iterate told = Told(jobs::Union(sampled.detail(), full.detail()));
  ASSERT_EQ(told.times_size(), 131);

  const v1::Iterate few = Narrowed(sampled, told);
  ASSERT_EQ(few.times_size(), 65);
  ASSERT_EQ(few.y_size(), 65 * 3);
  EXPECT_EQ(few.times(0), 0);
  EXPECT_EQ(few.times(64), 13);
  for (int k = 0; k < 65; ++k) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(few.y(3 * k + i), 100 * i + 10 * few.times(k), 1e-12);
  }
  for (int k = 1; k < 65; ++k) EXPECT_NEAR(few.times(k) - few.times(k - 1), 0.2, 0.11);
  EXPECT_THAT(few.y_components(), IsEmpty());
  EXPECT_EQ(few.change(), 1);

  const v1::Iterate all = Narrowed(View(v1::WATCH_VIEW_FULL), told);
  EXPECT_EQ(all.SerializeAsString(), told.SerializeAsString());

  const v1::Iterate chosen = Narrowed(full, told);
  EXPECT_EQ(chosen.times_size(), 131);
  EXPECT_THAT(chosen.y_components(), ElementsAre(2, 0, 2));
  ASSERT_EQ(chosen.y_size(), 131 * 3);
  EXPECT_EQ(chosen.y(3 * 130), 330);
  EXPECT_EQ(chosen.y(3 * 130 + 1), 130);
  EXPECT_EQ(chosen.y(3 * 130 + 2), 330);

  EXPECT_THAT(Narrowed(View(v1::WATCH_VIEW_RESIDUALS), told).times(), IsEmpty());
  EXPECT_THAT(Narrowed(WatchView(), told).y(), IsEmpty());
}

TEST_F(WatchViewTest, TakesComponentsOutOfComponents) {
  const v1::Iterate told = Told({.most_times = 2, .components = {0, 2}});
  EXPECT_THAT(told.times(), ElementsAre(0, 13));
  EXPECT_THAT(told.y(), ElementsAre(0, 200, 130, 330));
  EXPECT_THAT(Narrowed(View(v1::WATCH_VIEW_FULL, {2}), told).y(), ElementsAre(200, 330));
  // Emitted before a watcher wanted component 1, or all.
  EXPECT_THAT(Narrowed(View(v1::WATCH_VIEW_FULL, {2, 1}), told).times(), IsEmpty());
  EXPECT_THAT(Narrowed(View(v1::WATCH_VIEW_FULL), told).times(), IsEmpty());
}

TEST_F(WatchViewTest, StaysBelowWhatAMessageMayHold) {
  const v1::Iterate told = Told(View(v1::WATCH_VIEW_FULL).detail(), 1000, 1001);
  EXPECT_LT(told.ByteSizeLong(), 1'010'000u);
  EXPECT_GT(told.ByteSizeLong(), 900'000u);
  EXPECT_EQ(told.times(told.times_size() - 1), 100);
  // One time of very many components is more than that, and still the least there is.
  EXPECT_THAT(Told(View(v1::WATCH_VIEW_SAMPLED).detail(), 200'000, 3).times(), ElementsAre(0.2));
  EXPECT_THAT(Told(View(v1::WATCH_VIEW_SAMPLED, {199'999}).detail(), 200'000, 3).times(), ElementsAre(0, 0.1, 0.2));
}

TEST_F(WatchViewTest, TellsNothingWhereThereIsNothing) {
  EXPECT_THAT(Told({}).times(), IsEmpty());
  EXPECT_THAT(Told(View(v1::WATCH_VIEW_FULL).detail(), 0, 3).times(), IsEmpty());
  EXPECT_THAT(Told(View(v1::WATCH_VIEW_FULL, {7}).detail()).times(), IsEmpty());
}

TEST_F(WatchViewTest, RefusesWhatCannotBe) {
  const auto why = [](const v1::WatchSolveJobRequest& request) {
    const absl::Status status = WatchView::Create(request).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_THAT(why(Request(v1::WATCH_VIEW_SAMPLED, {0, -2})), HasSubstr("y_components[1]: -2"));
  EXPECT_THAT(why(Request(v1::WATCH_VIEW_RESIDUALS, {0})), HasSubstr("SAMPLED and FULL"));
  EXPECT_THAT(why(Request(static_cast<v1::WatchView>(17))), HasSubstr("view: 17"));

  v1::Analysis analysis;
  analysis.set_constraints(3);
  EXPECT_TRUE(View(v1::WATCH_VIEW_FULL, {0, 2}).Admits(analysis).ok());
  const absl::Status beyond = View(v1::WATCH_VIEW_FULL, {0, 3}).Admits(analysis);
  EXPECT_EQ(beyond.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(beyond.message()), HasSubstr("y_components[1]: 3; must be between 0 and 2"));
}

}  // namespace
}  // namespace dlcs
