// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/norms.h"

#include <algorithm>
#include <limits>

#include "core/linalg/simd/simd.h"

namespace dlcs {
namespace {

struct Columns {
  const double* values;
  Index rows, cols, stride;
};

struct Seen {
  double largest = 0;
  bool has_nan = false;

  void See(double value) {
    largest = std::max(largest, std::abs(value));  // which a NaN does not pass
    has_nan |= std::isnan(value);
  }
};

template <typename V>
DLCS_INLINE Seen SeeAll(const Columns& columns) {
  constexpr Index kWidth = sizeof(V) / sizeof(double), kVectors = 4;
  using Mask = decltype(V{} == V{});
  V sizes[kVectors] = {};
  Mask nans[kVectors] = {};
  Seen seen;
  for (Index j = 0; j < columns.cols; ++j) {
    const double* const column = columns.values + j * columns.stride;
    Index i = 0;
    for (; i + kVectors * kWidth <= columns.rows; i += kVectors * kWidth) {
      for (Index v = 0; v < kVectors; ++v) {
        const V value = Load<V>(column + i + v * kWidth), size = value > -value ? value : -value;
        sizes[v] = size > sizes[v] ? size : sizes[v];
        nans[v] |= value != value;
      }
    }
    for (; i < columns.rows; ++i) seen.See(column[i]);
  }
  for (Index v = 0; v < kVectors; ++v) {
    for (Index l = 0; l < kWidth; ++l) {
      seen.See(sizes[v][l]);
      seen.has_nan |= nans[v][l] != 0;
    }
  }
  return seen;
}

Seen SeeBaseline(const Columns& columns) { return SeeAll<Double2>(columns); }
DLCS_TARGET("avx2") Seen SeeAvx2(const Columns& columns) { return SeeAll<Double4>(columns); }
DLCS_TARGET("avx512f") Seen SeeAvx512(const Columns& columns) { return SeeAll<Double8>(columns); }

}  // namespace

double MaxAbsOfColumns(const double* values, Index rows, Index cols, Index stride) {
  static const auto see = ChooseVersion(SeeBaseline, SeeAvx2, SeeAvx512);
  const bool is_one_piece = stride == rows;
  const Seen seen = see({values, is_one_piece ? rows * cols : rows, is_one_piece ? 1 : cols, stride});
  return seen.has_nan ? std::numeric_limits<double>::quiet_NaN() : seen.largest;
}

void RaiseRowMaxAbsOfColumns(const double* values, Index rows, Index cols, Index stride, double* sizes) {
  RunWide([=]() DLCS_WIDE {
    double* __restrict raised = sizes;
    for (Index j = 0; j < cols; ++j) {
      const double* __restrict column = values + j * stride;
      for (Index i = 0; i < rows; ++i) {
        raised[i] = NanMax(raised[i], std::abs(column[i]));
      }
    }
  });
}

}  // namespace dlcs
