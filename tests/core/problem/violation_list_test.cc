// SPDX-License-Identifier: Apache-2.0
#include "core/problem/violation_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/cord.h"

namespace dlcs {
namespace {

using ::testing::IsEmpty;

TEST(ViolationListTest, AStatusCarriesWhatItWasGiven) {
  // Texts that a reader of the message could not tell apart: separators, lines, bytes that are no text, nothing at all.
  const std::vector<Violation> violations = {{"M[0][1]", "nan; every entry must be finite"},
                                             {"", "12:no field"},
                                             {"a: b\nc", ""},
                                             {"f", std::string("\0\xff:", 3)}};
  const absl::Status status = StatusOf(violations);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  const std::vector<Violation> carried = ViolationsOf(status);
  ASSERT_EQ(carried.size(), violations.size());
  for (std::size_t k = 0; k < carried.size(); ++k) {
    EXPECT_EQ(carried[k].field, violations[k].field) << k;
    EXPECT_EQ(carried[k].description, violations[k].description) << k;
  }
}

TEST(ViolationListTest, AMessageHasALineForEachViolation) {
  EXPECT_EQ(StatusOf({{"T", "-1; must be positive"}, {"", "no field"}}).message(), "T: -1; must be positive\nno field");
  EXPECT_EQ(InvalidField("steps", "0").message(), "steps: 0");
  EXPECT_TRUE(StatusOf({}).ok());
}

TEST(ViolationListTest, OtherStatusCarriesNone) {
  EXPECT_THAT(ViolationsOf(absl::OkStatus()), IsEmpty());
  EXPECT_THAT(ViolationsOf(absl::InvalidArgumentError("f: in words only")), IsEmpty());
}

TEST(ViolationListTest, DamagedPayloadsAreReadAsFarAsTheyGo) {
  for (const char* damaged : {"1:f", "1:f9:cut", "x", "99999999999999999999:f1:d", "-1:f1:d", "1f1d"}) {
    absl::Status status = absl::InvalidArgumentError("damaged");
    status.SetPayload(kViolationsPayload, absl::Cord(damaged));
    EXPECT_THAT(ViolationsOf(status), IsEmpty()) << damaged;
  }
}

}  // namespace
}  // namespace dlcs
