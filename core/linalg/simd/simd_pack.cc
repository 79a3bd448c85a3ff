// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/simd/simd_pack.h"

#include "core/linalg/simd/simd.h"

namespace dlcs {
namespace {

constexpr Index kLanes = 8;

// to[to_stride i + j] = from[from_stride j + i] for i, j < 4.
DLCS_INLINE void TransposeFour(const double* from, Index from_stride, double* to, Index to_stride) {
  const Double4 a = Load<Double4>(from), b = Load<Double4>(from + from_stride),
                c = Load<Double4>(from + 2 * from_stride), d = Load<Double4>(from + 3 * from_stride);
  const Double4 ab_even = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab_odd = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Double4 cd_even = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd_odd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  Store<Double4>(__builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5), to);
  Store<Double4>(__builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5), to + to_stride);
  Store<Double4>(__builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7), to + 2 * to_stride);
  Store<Double4>(__builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7), to + 3 * to_stride);
}

DLCS_INLINE void ToLanes(const double* columns, Index stride, Index rows, double* lanes, Index width) {
  Index i = 0;
  for (; i + 4 <= rows; i += 4) {
    TransposeFour(columns + i, stride, lanes + width * i, width);
    TransposeFour(columns + 4 * stride + i, stride, lanes + width * i + 4, width);
  }
  for (; i < rows; ++i) {
    for (Index l = 0; l < kLanes; ++l) lanes[width * i + l] = columns[stride * l + i];
  }
}

DLCS_INLINE void ToColumns(const double* lanes, Index width, Index rows, double* columns, Index stride) {
  Index i = 0;
  for (; i + 4 <= rows; i += 4) {
    TransposeFour(lanes + width * i, width, columns + i, stride);
    TransposeFour(lanes + width * i + 4, width, columns + 4 * stride + i, stride);
  }
  for (; i < rows; ++i) {
    for (Index l = 0; l < kLanes; ++l) columns[stride * l + i] = lanes[width * i + l];
  }
}

void ToLanesBaseline(const double* columns, Index stride, Index rows, double* lanes, Index width) {
  ToLanes(columns, stride, rows, lanes, width);
}
DLCS_TARGET("avx2") void ToLanesAvx2(const double* columns, Index stride, Index rows, double* lanes, Index width) {
  ToLanes(columns, stride, rows, lanes, width);
}
void ToColumnsBaseline(const double* lanes, Index width, Index rows, double* columns, Index stride) {
  ToColumns(lanes, width, rows, columns, stride);
}
DLCS_TARGET("avx2") void ToColumnsAvx2(const double* lanes, Index width, Index rows, double* columns, Index stride) {
  ToColumns(lanes, width, rows, columns, stride);
}

}  // namespace

void ColumnsToLanes(const double* columns, Index stride, Index rows, double* lanes, Index width) {
  static const auto transpose = ChooseVersion(ToLanesBaseline, ToLanesAvx2, ToLanesAvx2);
  transpose(columns, stride, rows, lanes, width);
}

void LanesToColumns(const double* lanes, Index width, Index rows, double* columns, Index stride) {
  static const auto transpose = ChooseVersion(ToColumnsBaseline, ToColumnsAvx2, ToColumnsAvx2);
  transpose(lanes, width, rows, columns, stride);
}

}  // namespace dlcs
