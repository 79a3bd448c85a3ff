// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/simd_pack.h"

#include <gtest/gtest.h>

namespace dlcs {
namespace {

TEST(SimdPackTest, TransposeThereAndBack) {
  std::srand(2);
  for (const Index rows : {1, 3, 4, 31}) {
    const Index stride = rows + 5;
    const Matrix columns = Matrix::Random(stride, 8);
    Matrix lanes = Matrix::Constant(8, rows, 7), back = Matrix::Constant(stride, 8, 7);
    ColumnsToLanes(columns.data(), stride, rows, lanes.data());
    EXPECT_EQ(lanes, columns.topRows(rows).transpose());
    LanesToColumns(lanes.data(), rows, back.data(), stride);
    EXPECT_EQ(back.topRows(rows), columns.topRows(rows));
    EXPECT_TRUE((back.bottomRows(5).array() == 7).all());  // beyond the rows nothing is touched
  }
}

}  // namespace
}  // namespace dlcs
