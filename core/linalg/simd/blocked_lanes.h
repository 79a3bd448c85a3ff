// SPDX-License-Identifier: Apache-2.0
// Blocks of 8 × 8 numbers, for loops that are compiled for each width of registers.

#ifndef DLCS_CORE_LINALG_SIMD_BLOCKED_LANES_H_
#define DLCS_CORE_LINALG_SIMD_BLOCKED_LANES_H_

#include "core/linalg/simd/simd.h"
#include "core/types.h"

namespace dlcs {

// Entry (i, j) stands at [8 j + i], so that columns are vectors.
struct alignas(64) EightBlock {
  static constexpr Index kSize = 8;
  double entries[kSize * kSize];

  const double* column(Index j) const { return entries + kSize * j; }
  double* column(Index j) { return entries + kSize * j; }
};

// In the functions below V is a vector of two, four or eight doubles; the result has the same bits for each.
namespace eight_blocks {

// result (-)= left · right
template <typename V, bool subtracts>
DLCS_INLINE void Multiply(const EightBlock& left, const EightBlock& right, EightBlock& result) {
  constexpr Index kWidth = sizeof(V) / sizeof(double), kSize = EightBlock::kSize;
  for (Index part = 0; part < kSize; part += kWidth) {
    V sums[kSize];
    for (Index j = 0; j < kSize; ++j) sums[j] = subtracts ? Load<V>(result.column(j) + part) : V{};
#pragma GCC unroll 8
    for (Index m = 0; m < kSize; ++m) {
      const V column = Load<V>(left.column(m) + part);
#pragma GCC unroll 8
      for (Index j = 0; j < kSize; ++j) {
        const V product = column * right.column(j)[m];
        sums[j] = subtracts ? sums[j] - product : sums[j] + product;
      }
    }
    for (Index j = 0; j < kSize; ++j) Store(sums[j], result.column(j) + part);
  }
}

// sums += block · x, in four independent sums; `part` is the index of the entries of V.
template <typename V>
DLCS_INLINE void AddTimes(const EightBlock& block, const double* x, Index part, V (&sums)[4]) {
#pragma GCC unroll 8
  for (Index m = 0; m < EightBlock::kSize; ++m) sums[m % 4] += Load<V>(block.column(m) + part) * x[m];
}

template <typename V>
DLCS_INLINE V Total(const V (&sums)[4]) {
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

// Gauss-Jordan elimination without exchanges; `pivots` gets the eight pivots.
template <typename V>
DLCS_INLINE void Invert(EightBlock& block, double* pivots) {
  constexpr Index kWidth = sizeof(V) / sizeof(double), kSize = EightBlock::kSize;
  using Mask = decltype(V{} == V{});
#pragma GCC unroll 8
  for (Index k = 0; k < kSize; ++k) {
    double row[kSize];
    for (Index j = 0; j < kSize; ++j) row[j] = block.column(j)[k];
    const double pivot = row[k], inverse = 1 / pivot;
    pivots[k] = pivot;
    for (Index j = 0; j < kSize; ++j) row[j] = j == k ? inverse : row[j] * inverse;
    for (Index part = 0; part < kSize; part += kWidth) {
      Mask is_pivot{};
      if (k >= part && k < part + kWidth) is_pivot[k - part] = -1;
      const V eliminated = Load<V>(block.column(k) + part);
#pragma GCC unroll 8
      for (Index j = 0; j < kSize; ++j) {
        const V column = j == k ? V{} : Load<V>(block.column(j) + part);
        const V value = V{} + row[j];
        Store(V(is_pivot ? value : column - row[j] * eliminated), block.column(j) + part);
      }
    }
  }
}

}  // namespace eight_blocks
}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SIMD_BLOCKED_LANES_H_
