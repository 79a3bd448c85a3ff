// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/pair_norms.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/linalg/norms.h"
#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {
namespace {

constexpr Index kPairsAtOnce = 16;

// |value| as an integer, in the same order; NaN is the largest. So a maximum of these sees NaN, and takes one
// instruction.
DLCS_WIDE inline std::int64_t SizeBits(double value) {
  return std::bit_cast<std::int64_t>(value) & std::numeric_limits<std::int64_t>::max();
}

struct Lanes {
  double residual[kPairsAtOnce] = {};
  std::int64_t size[kPairsAtOnce] = {};
};

// Raises `lanes` to the first `count` pairs, a multiple of kPairsAtOnce, and returns Σ y_i w_i. A NaN is seen in the
// size alone.
double MeasureWhole(const double* y, const double* w, Index count, Lanes& lanes) {
  double products[kPairsAtOnce];
  RunWide([=, &lanes, &products]() DLCS_WIDE {
    double residual[kPairsAtOnce], product[kPairsAtOnce] = {};
    std::int64_t size[kPairsAtOnce];
    for (Index l = 0; l < kPairsAtOnce; ++l) {
      residual[l] = lanes.residual[l];
      size[l] = lanes.size[l];
    }
    for (Index i = 0; i < count; i += kPairsAtOnce) {
      for (Index l = 0; l < kPairsAtOnce; ++l) {
        const double a = y[i + l], b = w[i + l];
        const double less = std::abs(a < b ? a : b);
        residual[l] = less > residual[l] ? less : residual[l];
        product[l] += a * b;
      }
      for (Index l = 0; l < kPairsAtOnce; ++l) {
        const std::int64_t of_y = SizeBits(y[i + l]), of_w = SizeBits(w[i + l]);
        const std::int64_t larger = of_y > of_w ? of_y : of_w;
        size[l] = larger > size[l] ? larger : size[l];
      }
    }
    for (Index l = 0; l < kPairsAtOnce; ++l) {
      lanes.residual[l] = residual[l];
      lanes.size[l] = size[l];
      products[l] = product[l];
    }
  });
  double sum = 0;
  for (const double product : products) sum += product;
  return sum;
}

}  // namespace

PairNorms MeasurePairs(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w) {
  const Index rows = y.rows(), whole = rows - rows % kPairsAtOnce;
  PairNorms norms;
  Lanes lanes;
  for (Index j = 0; j < y.cols(); ++j) {
    const double *const of_y = y.col(j).data(), *const of_w = w.col(j).data();
    double product = whole > 0 ? MeasureWhole(of_y, of_w, whole, lanes) : 0;
    for (Index i = whole; i < rows; ++i) {
      const double a = of_y[i], b = of_w[i];
      const double less = std::abs(a < b ? a : b), size = NanMax(std::abs(a), std::abs(b));
      norms.residual = less > norms.residual ? less : norms.residual;
      norms.size = NanMax(norms.size, size);
      product += a * b;
    }
    norms.complementarity = NanMax(norms.complementarity, std::abs(product));
  }
  for (Index l = 0; l < kPairsAtOnce; ++l) {
    norms.residual = std::max(norms.residual, lanes.residual[l]);
    norms.size = NanMax(norms.size, std::bit_cast<double>(lanes.size[l]));
  }
  if (std::isnan(norms.size)) norms.residual = norms.size;
  return norms;
}

}  // namespace dlcs
