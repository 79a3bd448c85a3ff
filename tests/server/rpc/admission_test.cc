// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/admission.h"

#include <gtest/gtest.h>

#include <utility>

namespace dlcs {
namespace {

TEST(AdmissionTest, SolversAreTakenAndGivenBack) {
  Admission admission(2, 100);
  auto first = admission.TakeSolver();
  auto second = admission.TakeSolver();
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(admission.solves(), 2);
  EXPECT_EQ(admission.TakeSolver().status().code(), absl::StatusCode::kResourceExhausted);
  first->reset();
  EXPECT_EQ(admission.solves(), 1);
  EXPECT_TRUE(admission.TakeSolver().ok());
}

TEST(AdmissionTest, ResultsShareTheMemory) {
  Admission admission(2, 100);
  auto sixty = admission.HoldResult(60);
  ASSERT_TRUE(sixty.ok());
  EXPECT_FALSE(admission.HoldResult(41).ok());
  const auto forty = admission.HoldResult(40);
  EXPECT_TRUE(forty.ok());
  EXPECT_FALSE(admission.HoldResult(1).ok());
  sixty->reset();
  EXPECT_TRUE(admission.HoldResult(60).ok());
}

TEST(AdmissionTest, HugeResultsDoNotOverflow) {
  Admission admission(1, 100);
  const auto held = admission.HoldResult(50);
  EXPECT_FALSE(admission.HoldResult(INT64_MAX).ok());
}

}  // namespace
}  // namespace dlcs
