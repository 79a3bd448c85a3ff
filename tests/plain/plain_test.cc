// SPDX-License-Identifier: Apache-2.0
// A part of plain_dlcs with fixed seeds: no answer is wrong, and few are refused without need.

#include <gtest/gtest.h>

#include <string>

#include "tests/hostile/trial_arguments.h"
#include "tests/plain/plain_trial.h"

namespace dlcs::plain {
namespace {

using hostile::Judgment;

constexpr uint64_t kFirstSeed = 1147;
constexpr uint64_t kSeeds = 310;  // ten of each family

struct Share {
  double tolerance;  // 0: the default
  int of_refused;    // at most one in so many is refused without need
};
class PlainSystems : public ::testing::TestWithParam<Share> {};

TEST_P(PlainSystems, AreNeverWrongAndSeldomRefusedWithoutNeed) {
  const double tolerance = GetParam().tolerance;
  int refused = 0, right = 0, others = 0;
  std::string seeds;
  for (uint64_t seed = kFirstSeed; seed < kFirstSeed + kSeeds; ++seed) {
    const PlainSystem plain = MakePlainSystem(seed);
    const PlainTrial trial = TryPlain(plain, hostile::ReferenceOf(plain.system), {.tolerance = tolerance}, 5);
    EXPECT_NE(trial.judgment, Judgment::kWrong)
        << "seed " << seed << ", " << plain.system.traits << ": error " << trial.error << " of " << trial.component
        << ", allowed " << trial.allowed << ", " << trial.verdict;
    right += trial.judgment == Judgment::kRight;
    if (trial.judgment != Judgment::kRefused) continue;
    // A neutral current whose equation has rounding for what would be zero is tied to the phases by 1e-16, and so has
    // no size to be looked at beside.
    const bool is_tied = plain.system.traits.find("neutral as a state") != std::string::npos;
    ++(is_tied ? others : refused);
    seeds += " " + std::to_string(seed);
  }
  EXPECT_LE(refused, static_cast<int>(kSeeds) / GetParam().of_refused) << right << " right; refused:" << seeds;
  EXPECT_LE(others, 6) << seeds;
  EXPECT_GT(right, 250);
}

INSTANTIATE_TEST_SUITE_P(Tolerances, PlainSystems,
                         ::testing::Values(Share{1e-4, 200}, Share{1e-7, 200}, Share{1e-10, 50}, Share{0, 200}),
                         [](const ::testing::TestParamInfo<Share>& share) {
                           return "T" + std::to_string(share.index) + "Of" + std::to_string(share.param.of_refused);
                         });

// In exact numbers a tank at rest moves by what the last bit of its source is off, at most twice that.
TEST(PlainReference, StaysAtRest) {
  constexpr uint64_t kTankAtRest = 4;
  const PlainSystem plain = MakePlainSystem(kTankAtRest);
  ASSERT_EQ(plain.family, "tank at rest");
  const hostile::Reference reference = hostile::ReferenceOf(plain.system);
  ASSERT_EQ(reference.status, hostile::Reference::Status::kReached) << reference.reason;
  for (Index i = 0; i < reference.x.rows(); ++i) {
    const double start = plain.system.x0[i];
    EXPECT_LE((reference.x.row(i).array() - start).abs().maxCoeff(), 0x1p-51 * plain.beside[i]);
  }
}

TEST(PlainSystem, IsAFunctionOfItsSeed) {
  for (uint64_t seed = 0; seed < static_cast<uint64_t>(NumFamilies()); ++seed) {
    EXPECT_EQ(ToJson(MakePlainSystem(seed).system), ToJson(MakePlainSystem(seed).system));
    EXPECT_NE(ToJson(MakePlainSystem(seed).system),
              ToJson(MakePlainSystem(seed + static_cast<uint64_t>(NumFamilies())).system));
  }
}

}  // namespace
}  // namespace dlcs::plain
