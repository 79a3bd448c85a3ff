// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/simd/simd_pack.h"

#include <gtest/gtest.h>

namespace dlcs {
namespace {

TEST(SimdPackTest, TransposeThereAndBack) {
  std::srand(2);
  for (const Index rows : {1, 3, 4, 31}) {
    for (const Index width : {8, 16}) {
      const Index stride = rows + 5;
      const Matrix columns = Matrix::Random(stride, 8);
      Matrix lanes = Matrix::Constant(width, rows, 7), back = Matrix::Constant(stride, 8, 7);
      ColumnsToLanes(columns.data(), stride, rows, lanes.data(), width);
      EXPECT_EQ(lanes.topRows(8), columns.topRows(rows).transpose());
      EXPECT_TRUE((lanes.bottomRows(width - 8).array() == 7).all());  // beside the lanes nothing is touched
      LanesToColumns(lanes.data(), width, rows, back.data(), stride);
      EXPECT_EQ(back.topRows(rows), columns.topRows(rows));
      EXPECT_TRUE((back.bottomRows(5).array() == 7).all());  // nor beyond the rows
    }
  }
}

}  // namespace
}  // namespace dlcs
