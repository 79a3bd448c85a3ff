// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/toeplitz_convolution.h"

#include <gtest/gtest.h>

#include "core/linalg/norms.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

Matrix SumByDefinition(const Matrix& blocks, const Matrix& d) {
  const Index n = d.rows();
  Matrix r = Matrix::Zero(n, d.cols());
  for (Index j = 0; j < d.cols(); ++j) {
    for (Index l = 0; l <= j; ++l) r.col(j) += blocks.middleCols((j - l) * n, n) * d.col(l);
  }
  return r;
}

TEST(ToeplitzConvolutionTest, MatchesTheDefinitionForShortAndLongWindows) {
  Workers workers(2);
  for (const Index n : {1, 2, 5, 20}) {
    for (const Index window : {1, 2, 31, 128, 129, 800}) {
      const Matrix blocks = RandomMatrix(n, n * window, 1);
      const Matrix d = RandomMatrix(n, window, 2);
      ToeplitzConvolution convolution(n);
      const double scale = static_cast<double>(n * window);
      EXPECT_LT(MaxAbs(convolution.Apply(blocks, d, workers) - SumByDefinition(blocks, d)), 1e-14 * scale)
          << n << " " << window;
    }
  }
}

TEST(ToeplitzConvolutionTest, TakesAWindowShorterThanTheKernel) {
  Workers workers(1);
  const Matrix blocks = RandomMatrix(2, 2 * 1500, 3);
  ToeplitzConvolution convolution(2);
  for (const Index window : {1100, 60, 1500, 1100}) {
    const Matrix d = RandomMatrix(2, window, 4);
    EXPECT_LT(MaxAbs(convolution.Apply(blocks, d, workers) - SumByDefinition(blocks, d)), 1e-11) << window;
  }
}

TEST(ToeplitzConvolutionTest, SeesBlocksThatWereAddedSince) {
  Workers workers(1);
  const Matrix all = RandomMatrix(2, 2 * 1500, 7);
  ToeplitzConvolution convolution(2);
  for (const Index count : {300, 301, 1024, 1500}) {
    const Matrix blocks = all.leftCols(2 * count);
    const Matrix d = RandomMatrix(2, count, 8);
    const Matrix r = convolution.Apply(blocks, d, workers);
    EXPECT_LT(MaxAbs(r - SumByDefinition(blocks, d)), 1e-11) << count;
    EXPECT_TRUE((r.array() == ToeplitzConvolution(2).Apply(blocks, d, workers).array()).all()) << count;
  }
}

TEST(ToeplitzConvolutionTest, HasTheSameBitsForAnyNumberOfThreads) {
  for (const Index window : {100, 2000}) {
    const Matrix blocks = RandomMatrix(3, 3 * window, 5);
    const Matrix d = RandomMatrix(3, window, 6);
    Matrix first;
    for (const int threads : {1, 2, 4}) {
      Workers workers(threads);
      ToeplitzConvolution convolution(3);
      const Matrix r = convolution.Apply(blocks, d, workers);
      if (threads == 1) first = r;
      EXPECT_TRUE((r.array() == first.array()).all()) << threads;
    }
  }
}

}  // namespace
}  // namespace dlcs
