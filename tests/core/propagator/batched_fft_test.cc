// SPDX-License-Identifier: Apache-2.0
// Fourier transforms side by side, against the sum that defines them.
#include "core/propagator/batched_fft.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

using ComplexMatrix = Eigen::MatrixXcd;

// Columns are sequences.
ComplexMatrix BySums(const ComplexMatrix& x) {
  const Index length = x.rows();
  ComplexMatrix turn(length, length);
  for (Index k = 0; k < length; ++k) {
    for (Index j = 0; j < length; ++j) {
      turn(k, j) =
          std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(j * k % length) / static_cast<double>(length));
    }
  }
  return turn * x;
}

ComplexMatrix ByLanes(const ComplexMatrix& x) {
  const Index length = x.rows(), lanes = x.cols();
  Matrix re = x.real().transpose(), im = x.imag().transpose(), work_re(lanes, length), work_im(lanes, length);
  const auto result = BatchedFft(length).Forward(lanes, {re.data(), im.data()}, {work_re.data(), work_im.data()});
  const Eigen::Map<Matrix> out_re(result.re, lanes, length), out_im(result.im, lanes, length);
  ComplexMatrix transformed(length, lanes);
  transformed.real() = out_re.transpose();
  transformed.imag() = out_im.transpose();
  return transformed;
}

TEST(BatchedFftTest, TransformsEveryLane) {
  std::srand(2);
  for (const Index length : {1, 2, 3, 4, 5, 6, 8, 10, 15, 16, 20, 27, 32, 60, 64, 120, 125, 128, 135, 256}) {
    ASSERT_TRUE(BatchedFft::IsFastLength(length));
    for (const Index lanes : {1, 3, 8}) {
      const ComplexMatrix x = ComplexMatrix::Random(length, lanes);
      EXPECT_LE(MaxAbs((ByLanes(x) - BySums(x)).cwiseAbs()), 1e-15 * static_cast<double>(4 + length)) << length;
    }
  }
  EXPECT_FALSE(BatchedFft::IsFastLength(14));
}

TEST(BatchedFftTest, ALaneHasTheSameBitsAmongOthers) {
  std::srand(3);
  for (const Index length : {45, 128}) {
    const ComplexMatrix x = ComplexMatrix::Random(length, 8);
    const ComplexMatrix together = ByLanes(x);
    for (Index lane = 0; lane < 8; ++lane) EXPECT_EQ(ByLanes(x.col(lane)), together.col(lane));
  }
}

}  // namespace
}  // namespace dlcs
