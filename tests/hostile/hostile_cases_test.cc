// SPDX-License-Identifier: Apache-2.0
// Systems that once had a wrong answer, one file each in tests/hostile/cases.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "tests/hostile/case_file.h"
#include "tests/hostile/trial.h"

namespace dlcs::hostile {
namespace {

class HostileCases : public ::testing::TestWithParam<std::string> {};

// Two references that share no code: one of the two was in use when the fault was found.
TEST_P(HostileCases, HaveTheExpectedReference) {
  const CaseFile the_case = ReadCase(GetParam());
  if (the_case.system.several_solutions) return;
  std::vector<double> times;
  for (const CaseFile::Expected& expected : the_case.expected) times.push_back(expected.time);
  const Reference reference = Refer(the_case.system, times);
  ASSERT_EQ(reference.status, Reference::Status::kReached) << reference.reason << " at " << reference.end;
  for (size_t k = 0; k < times.size(); ++k) {
    for (Index i = 0; i < reference.x.rows(); ++i) {
      EXPECT_NEAR(reference.x(i, static_cast<Index>(k)), the_case.expected[k].x(i),
                  the_case.accuracy * reference.size(i))
          << "x" << i + 1 << " at t = " << times[k];
    }
  }
}

class HostileAnswers : public ::testing::TestWithParam<std::string> {};

TEST_P(HostileAnswers, AreWithinTheErrorAskedFor) {
  const CaseFile the_case = ReadCase(GetParam());
  const Reference reference = ReferenceOf(the_case.system);
  for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
    const Trial trial = Try(the_case.system, reference, {.tolerance = tolerance}, 10);
    // A refusal is right too, if one ulp of the data makes a large part of the requested error, or more.
    const bool is_limited = trial.judgment == Judgment::kRefusedWithNeed ||
                            (trial.judgment == Judgment::kRefused && 2 * *trial.condition > tolerance);
    EXPECT_TRUE(trial.judgment == Judgment::kRight || is_limited)
        << Name(trial.judgment) << " at tolerance " << tolerance << ": error " << trial.error.value_or(-1) << " of "
        << trial.component << ", figure " << trial.figure.value_or(-1) << ", condition " << trial.condition.value_or(-1)
        << ", " << trial.verdict;
    EXPECT_GE(trial.figure.value_or(0), trial.error_of_figure.value_or(INFINITY) / 3)
        << "at tolerance " << tolerance << ", " << trial.component << " at t = " << trial.time;
  }
}

std::string TestName(const ::testing::TestParamInfo<std::string>& parameter) {
  std::string name = parameter.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Files, HostileCases, ::testing::ValuesIn(CaseNames()), TestName);
INSTANTIATE_TEST_SUITE_P(Files, HostileAnswers,
                         ::testing::Values("break_point_of_a_formula", "inconsistent_by_rounding", "jump_of_zero_115",
                                           "psd_more_pairs_than_states_14", "refused_by_5e-324", "rescaled_2040",
                                           "rescaled_2064", "stiff_event_driven_0", "stiff_event_driven_25",
                                           "stiff_march_1e+09", "stiff_march_1e+12", "stiff_scalar_z_73",
                                           "two_methods_two_solutions", "units_1e4", "units_1e4_stiff", "units_1e8",
                                           "units_random_7029_1e6", "units_random_7045_1e6", "rounding_of_slow_states"),
                         TestName);

}  // namespace
}  // namespace dlcs::hostile
