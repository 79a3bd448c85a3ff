// SPDX-License-Identifier: Apache-2.0
// Systems that were answered wrongly once, one file each in tests/hostile/cases.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

#include "tests/hostile/case_file.h"
#include "tests/hostile/reference.h"

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

std::string TestName(const ::testing::TestParamInfo<std::string>& parameter) {
  std::string name = parameter.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Files, HostileCases, ::testing::ValuesIn(CaseNames()), TestName);

}  // namespace
}  // namespace dlcs::hostile
