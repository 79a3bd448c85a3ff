// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/semiobservability.h"

#include <gtest/gtest.h>

#include "core/linalg/phi_functions.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using Sign = LexicographicRow::Sign;
using testing::LcpGenerator;

// Small integers, so that all arithmetic is exact; sparse, so that many first entries vanish.
Matrix SparseIntegers(LcpGenerator& generator, Index rows, Index columns) {
  return Matrix::NullaryExpr(rows, columns, [&] {
    return generator.Integer(0, 2) == 0 ? static_cast<double>(generator.Integer(-2, 2)) : 0.0;
  });
}

TEST(SemiobservabilityTest, AgreesWithTheSignOfTheFreeMotion) {
  LcpGenerator generator(10);
  int members = 0, outsiders = 0, late = 0;
  for (int k = 0; k < 2000; ++k) {
    const Index m = generator.Integer(1, 4), n = generator.Integer(1, 3);
    const Matrix A = SparseIntegers(generator, m, m), C = SparseIntegers(generator, n, m);
    const Vector x0 = SparseIntegers(generator, m, 1);
    const Semiobservability start = TestSemiobservability(C, A, x0);
    ASSERT_NE(start.in_cone.answer, Answer::kUnknown);
    bool nonnegative = true, zero = true;
    for (const double t : {1e-3, 2e-3}) {
      const Vector w = C * (ComputePhiFunctions(t * A).phi0 * x0);
      nonnegative = nonnegative && w.minCoeff() >= -1e-13;  // a first entry k = 3 gives 1e-9/6
      zero = zero && w.cwiseAbs().maxCoeff() <= 1e-13;
    }
    EXPECT_EQ(start.in_cone.yes(), nonnegative) << C << "\n\n" << A << "\n\n" << x0;
    EXPECT_EQ(start.in_unobservable_space.yes(), zero);
    (nonnegative ? members : outsiders) += 1;
    for (const LexicographicRow& row : start.rows) late += row.sign != Sign::kZero && row.power > 0 ? 1 : 0;
  }
  EXPECT_GT(members, 50);
  EXPECT_GT(outsiders, 50);
  EXPECT_GT(late, 50);
}

TEST(SemiobservabilityTest, UnobservableMeansBothSigns) {
  const Matrix C{{1, -1}}, A{{0, 1}, {1, 0}};
  EXPECT_TRUE(TestSemiobservability(C, A, Vector{{1, 1}}).in_unobservable_space.yes());
  EXPECT_TRUE(TestSemiobservability(C, A, Vector{{1, 0}}).in_cone.yes());
  EXPECT_TRUE(TestSemiobservability(C, A, Vector{{1, 0}}).in_unobservable_space.no());
  EXPECT_TRUE(TestSemiobservability(C, A, Vector{{-1, 0}}).in_cone.no());
}

// 0.1 + 0.2 - 0.3 is no zero of the given numbers (it is 2.8e-17), but the plain sum cannot be trusted with
// less.
TEST(SemiobservabilityTest, LeavesOpenWhatRoundingCouldDecide) {
  const Semiobservability start =
      TestSemiobservability(Matrix{{0.1, 0.2, -0.3}}, Matrix::Zero(3, 3), Vector::Constant(3, 0.7));
  EXPECT_EQ(start.rows[0].sign, Sign::kUndecided);
  EXPECT_GT(start.rows[0].error, 0);
  EXPECT_EQ(start.in_cone.answer, Answer::kUnknown);
  EXPECT_EQ(start.in_unobservable_space.answer, Answer::kUnknown);
}

TEST(SemiobservabilityTest, DoesNotDependOnTheSizeOfA) {
  const Matrix A{{0, 1, 0}, {0, 0, 1}, {0, 0, 0}}, C{{1, 0, 0}};
  for (const double size : {1e-60, 1.0, 1e60}) {
    const Semiobservability start = TestSemiobservability(C, size * A, Vector{{0, 0, -1}});
    EXPECT_TRUE(start.in_cone.no()) << start.in_cone.why;
    EXPECT_EQ(start.rows[0].power, 2);
  }
}

}  // namespace
}  // namespace dlcs
