// SPDX-License-Identifier: Apache-2.0
// Every class of matrices that the analysis decides, for small integers in any units.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "core/matrix_classes/class_profile.h"
#include "tests/hostile/exact_classes_truth.h"
#include "tests/hostile/hostile_count.h"
#include "tests/hostile/lcp_cases.h"
#include "tests/support/integer_matrices.h"

namespace dlcs {
namespace {

using testing::DoubledSymmetricPart;
using testing::ExactMinorClasses;
using testing::IntegerMatrix;
using testing::IntegerMatrixGenerator;

struct Count {
  int decided = 0, unknown = 0;
};

void Compare(const Fact& fact, bool truth, const char* name, Count& count) {
  if (fact.answer == Answer::kUnknown) {
    ++count.unknown;
    if (std::getenv("DLCS_HOSTILE_SHOW") != nullptr) std::printf("unknown: %s, %s\n", name, fact.why.c_str());
    return;
  }
  ++count.decided;
  EXPECT_EQ(fact.yes(), truth) << name << ": " << fact.why;
}

bool IsZ(const IntegerMatrix& M) {
  for (std::size_t i = 0; i < M.size(); ++i) {
    for (std::size_t j = 0; j < M.size(); ++j) {
      if (i != j && M[i][j] > 0) return false;
    }
  }
  return true;
}

Matrix InUnits(const IntegerMatrix& M, const testing::LcpUnits& units) {
  return testing::InUnits({testing::LcpKind::kAny, M, std::vector<std::int64_t>(M.size(), 0)}, units).M;
}

TEST(HostileClassesTest, AreThoseOfTheIntegers) {
  const testing::HostileRange range = testing::HostileSeeds(120);
  Count count;
  for (int k = 0; k < range.count; ++k) {
    const unsigned seed = range.first_seed + static_cast<unsigned>(k);
    SCOPED_TRACE("seed " + std::to_string(seed));
    IntegerMatrixGenerator generator(seed);
    std::mt19937_64 of_units(seed);
    const IntegerMatrix a = k % 2 == 0 ? generator.Any(generator.Integer(1, 4)) : testing::MakeLcpCase(seed).M;
    const auto n = static_cast<Index>(a.size());
    // Units that keep y_i w_i keep the quadratic form; others the classes that signs define.
    const bool congruent = k % 4 < 2;
    const int spread = k % 3 == 0 ? 0 : 20;
    const Matrix M = InUnits(a, testing::MakeUnits(n, spread, congruent, of_units));
    SCOPED_TRACE(testing::AsFile({M, Vector::Zero(n)}));
    const ClassProfile known = ProfileOf(M);

    const testing::MinorTruth minors = ExactMinorClasses(a);
    Compare(known.minors.nondegenerate, minors.nondegenerate, "nondegenerate", count);
    Compare(known.minors.p, minors.p, "P", count);
    Compare(known.minors.p0, minors.p0, "P0", count);
    Compare(known.minors.n, minors.n, "N", count);
    Compare(known.minors.np, minors.np, "NP", count);
    Compare(known.minors.pn, minors.pn, "PN", count);
    Compare(known.z, IsZ(a), "Z", count);
    Compare(known.m, IsZ(a) && minors.p, "M", count);
    Compare(known.semicopositive.strict, testing::ExactlyStrictlySemicopositive(a), "strictly semicopositive", count);
    if (n <= 4) Compare(known.semicopositive.weak, testing::ExactlySemicopositive(a), "semicopositive", count);
    if (congruent) {
      const testing::MinorTruth form = ExactMinorClasses(DoubledSymmetricPart(a));
      const testing::CopositiveTruth copositive = testing::ExactlyCopositive(a);
      Compare(known.quadratic_form.positive_definite, form.p, "positive definite", count);
      Compare(known.quadratic_form.positive_semidefinite, form.p0, "positive semidefinite", count);
      Compare(known.copositive.strictly_copositive, copositive.strictly_copositive, "strictly copositive", count);
      Compare(known.copositive.copositive, copositive.copositive, "copositive", count);
    }
    Compare(known.s, testing::IsExactlyS(a), "S", count);
    Compare(known.r0, testing::IsExactlyR0(a), "R0", count);
    if (n <= 3) {
      const testing::QTruth truth = testing::ExactlyQAndQ0(a);
      Compare(known.q, truth.q, "Q", count);
      Compare(known.q0, truth.q0, "Q0", count);
      Compare(known.hidden_z, testing::IsExactlyHiddenZ(a), "hidden Z", count);
    } else if (n == 4) {
      EXPECT_NE(known.q.answer, Answer::kUnknown);
      EXPECT_NE(known.q0.answer, Answer::kUnknown);
      EXPECT_NE(known.hidden_z.answer, Answer::kUnknown);
    }
  }
  std::printf("%d matrices: %d classes decided, %d unknown\n", range.count, count.decided, count.unknown);
  EXPECT_LE(count.unknown, count.decided / 1000);
}

TEST(HostileClassesTest, NothingIsUnknownOfTheSmallestMatrices) {
  for (int code = 0; code < 625; ++code) {  // all 2 x 2 with entries of size two
    const Matrix M{{double(code % 5 - 2), double(code / 5 % 5 - 2)},
                   {double(code / 25 % 5 - 2), double(code / 125 - 2)}};
    const ClassProfile known = ProfileOf(M);
    for (const Fact* fact : {&known.s, &known.r0, &known.q, &known.q0, &known.hidden_z, &known.m, &known.minors.p,
                             &known.quadratic_form.positive_semidefinite, &known.copositive.copositive}) {
      EXPECT_NE(fact->answer, Answer::kUnknown) << fact->why << "\n" << M;
    }
  }
}

}  // namespace
}  // namespace dlcs
