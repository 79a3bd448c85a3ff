// SPDX-License-Identifier: Apache-2.0
#include "core/problem/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "core/problem/solution.h"
#include "tests/support/non_finite.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::kInfinity;
using testing::kNaN;

std::vector<std::string> ComplaintsAfter(const std::function<void(Options&)>& change, double horizon = 2) {
  Options options;
  change(options);
  std::vector<std::string> complaints;
  for (const Violation& violation : Validate(options, horizon)) {
    complaints.push_back(violation.field + ": " + violation.description);
  }
  return complaints;
}

TEST(OptionsTest, FindsNothingWrongWithTheDefaults) {
  EXPECT_THAT(ComplaintsAfter([](Options&) {}), IsEmpty());
}

TEST(OptionsTest, AllowsTheEndsOfEveryRange) {
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.num_steps = 1'000'000'000;
                o.output_times = {0, 1, 2};
                o.theta = 1;
                o.window_steps = Options::kWholeHorizon;
                o.iteration_tolerance = 1;
                o.num_contour_nodes = 1;
                o.contour_gamma = 1.5707;
              }),
              IsEmpty());
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.step = 3; }),
              IsEmpty());  // longer than the horizon: one step
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.step = 2e-9; }), IsEmpty());
}

TEST(OptionsTest, RefusesWhatIsBeyondARange) {
  for (const OptionRange& range : kOptionRanges) {
    const auto is_refused = [&](double value) {
      return std::visit(
          [&](const auto member) {
            Options options;
            options.*member = static_cast<std::remove_reference_t<decltype(options.*member)>>(value);
            std::vector<std::string> rules;
            for (const Violation& violation : Validate(options, 2)) {
              if (violation.field == range.field) rules.push_back(violation.description);
            }
            const std::string otherwise = range.otherwise ? std::string(", or ") + range.otherwise : "";
            return !rules.empty() && rules.front().ends_with(std::string("; must be ") + range.words + otherwise);
          },
          range.value);
    };
    SCOPED_TRACE(range.field);
    const double default_value =
        std::visit([](const auto member) { return static_cast<double>(Options().*member); }, range.value);
    const bool whole = !std::holds_alternative<double Options::*>(range.value);
    const auto next = [&](double value, double towards) {
      return whole ? value + (towards > value ? 1 : -1) : std::nextafter(value, towards);
    };
    EXPECT_FALSE(is_refused(range.least));
    EXPECT_TRUE(is_refused(whole ? -2 : -1e-300));
    const double below = next(range.least, -kInfinity);
    EXPECT_EQ(is_refused(below), below != default_value) << below;
    if (std::isfinite(range.most)) {
      EXPECT_FALSE(is_refused(range.most));
      EXPECT_TRUE(is_refused(next(range.most, kInfinity)));
    }
    if (!whole) {
      EXPECT_TRUE(is_refused(kNaN));
    }
  }
}

TEST(OptionsTest, ChecksTheGrid) {
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.num_steps = -1; }),
              ElementsAre("num_steps: -1; must be between 1 and 1000000000, or 0 for the default"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.num_steps = 1'000'000'001; }),
              ElementsAre("num_steps: 1000000001; must be between 1 and 1000000000, or 0 for the default"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.step = -0.5; }),
              ElementsAre("step: -0.5; must be a number above 0, or 0 for the default"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.step = kNaN; }),
              ElementsAre("step: nan; must be a number above 0, or 0 for the default"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.step = kInfinity; }),
              ElementsAre("step: inf; must be a number above 0, or 0 for the default"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.step = 1e-9; }),
              ElementsAre("step: 1e-09; takes more than 1000000000 steps over T = 2"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.step = 0.1;
                o.num_steps = 5;
              }),
              ElementsAre("step: 0.1; only one of step and num_steps may be set, and num_steps is 5"));
}

TEST(OptionsTest, ChecksTheOutputTimes) {
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.output_times = {-0.5, 1, 1, kNaN, 2.5};
              }),
              ElementsAre("output_times[2]: 1; must be greater than the time before it, 1",
                          "output_times[3]: nan; every time must be finite",
                          "output_times[0]: -0.5; must lie in [0, T] = [0, 2]",
                          "output_times[4]: 2.5; must lie in [0, T] = [0, 2]"));
}

// The horizon has its own complaint; it must not bring others with it.
TEST(OptionsTest, LeavesOutWhatABadHorizonMakesMeaningless) {
  for (const double horizon : {kNaN, -1.0, 0.0, kInfinity}) {
    EXPECT_THAT(ComplaintsAfter(
                    [](Options& o) {
                      o.step = 1e-9;
                      o.output_times = {0, 1};
                    },
                    horizon),
                IsEmpty())
        << horizon;
  }
}

TEST(OptionsTest, ChecksTheta) {
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.theta = 1.5; }), ElementsAre("theta: 1.5; must be between 0 and 1"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.theta = -0.1; }), ElementsAre("theta: -0.1; must be between 0 and 1"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.theta = kNaN; }), ElementsAre("theta: nan; must be between 0 and 1"));
}

TEST(OptionsTest, ChecksTheIteration) {
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.window_steps = -2;
                o.iteration_tolerance = 0;
                o.max_iterations = -1;
              }),
              ElementsAre("window_steps: -2; must be at least 1, or 0 to adapt, or -1 for the whole horizon",
                          "iteration_tolerance: 0; must be above 0 and at most 1",
                          "max_iterations: -1; must be at least 1, or 0 for the default"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.iteration_tolerance = kNaN; }),
              ElementsAre("iteration_tolerance: nan; must be above 0 and at most 1"));
  for (const Index windows : {0, 65}) {
    EXPECT_THAT(ComplaintsAfter([&](Options& o) { o.windows_in_flight = windows; }),
                ElementsAre("windows_in_flight: " + std::to_string(windows) + "; must be between 1 and 64"));
  }
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.iteration_tolerance = 1.5; }),
              ElementsAre("iteration_tolerance: 1.5; must be above 0 and at most 1"));
}

TEST(OptionsTest, ChecksThePeriod) {
  const std::string rule =
      "; must be positive and finite, or -1 to find that of an autonomous oscillation, or 0 for a solve from x0";
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.period = -2; }), ElementsAre("period: -2" + rule));
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.period = kNaN; }), ElementsAre("period: nan" + rule));
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.period = 1;
                o.method = Method::kTimeStepping;
              }),
              ElementsAre("method: time-stepping; must be event-driven or left open where a periodic solution is asked "
                          "for"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.period = 0.25;
                o.output_times = {0.25, 0.5};
              }),
              ElementsAre("output_times[1]: 0.5; must lie in [0, T] = [0, 0.25]"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.period = Options::kFindPeriod;
                o.output_times = {0.25};
              }),
              ElementsAre("output_times: 1 times; must not be set where the period is to be found: ask for a number of "
                          "steps"));
}

TEST(OptionsTest, ChecksTheContourAndTheThreads) {
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.num_contour_nodes = 0;
                o.contour_gamma = 1.5708;
                o.contour_mu = -1;
                o.contour_step = kInfinity;
                o.num_threads = -4;
              }),
              ElementsAre("num_contour_nodes: 0; must be between 1 and 10000",
                          "contour_gamma: 1.5708; must be above 0 and below pi/2, or 0 for the default",
                          "contour_mu: -1; must be a number above 0, or 0 for the default",
                          "contour_step: inf; must be a number above 0, or 0 for the default",
                          "num_threads: -4; must be at least 0"));
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.contour_gamma = kNaN;
                o.contour_mu = kNaN;
              }),
              ElementsAre("contour_gamma: nan; must be above 0 and below pi/2, or 0 for the default",
                          "contour_mu: nan; must be a number above 0, or 0 for the default"));
}

TEST(OptionsTest, NamesMethodsAndTerminations) {
  EXPECT_STREQ(MethodName(Method::kAuto), "auto");
  EXPECT_STREQ(MethodName(Method::kLaplaceIteration), "laplace-iteration");
  EXPECT_STREQ(MethodName(Method::kWuChenIteration), "wu-chen-iteration");
  EXPECT_STREQ(MethodName(Method::kExponentialIntegrator), "exponential-integrator");
  EXPECT_STREQ(MethodName(Method::kTimeStepping), "time-stepping");
  EXPECT_STREQ(TerminationName(Termination::kReachedEnd), "REACHED_END");
  EXPECT_STREQ(TerminationName(Termination::kInfeasible), "INFEASIBLE");
  EXPECT_STREQ(TerminationName(Termination::kDiverged), "DIVERGED");
  EXPECT_STREQ(TerminationName(Termination::kIterationLimit), "ITERATION_LIMIT");
  EXPECT_STREQ(TerminationName(Termination::kInconsistentState), "INCONSISTENT_STATE");
  EXPECT_STREQ(TerminationName(Termination::kUnsupported), "UNSUPPORTED");
  EXPECT_STREQ(TerminationName(Termination::kNonFinite), "NON_FINITE");
  EXPECT_STREQ(TerminationName(Termination::kCancelled), "CANCELLED");
}

TEST(OptionsTest, ChecksTheNodesThatAreGiven) {
  EXPECT_THAT(ComplaintsAfter([](Options& o) { o.grid_times = {0, 0.5, 2}; }), IsEmpty());
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.grid_times = {0.5, 3};
              }),
              ElementsAre("grid_times[1]: 3; must lie in [0, T] = [0, 2]"));
  EXPECT_EQ(ComplaintsAfter([](Options& o) { o.grid_times = {0.5, 0.5}; }).size(), 1u);
  EXPECT_EQ(ComplaintsAfter([](Options& o) { o.grid_times = {kNaN}; }).size(), 1u);
  EXPECT_THAT(ComplaintsAfter([](Options& o) {
                o.grid_times = {0.5};
                o.num_steps = 3;
              }),
              ElementsAre("grid_times: 1 times; only one of grid_times, step and num_steps may be set"));
}

}  // namespace
}  // namespace dlcs
