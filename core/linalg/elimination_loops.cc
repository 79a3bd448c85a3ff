// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/elimination_loops.h"

#include <cstring>

#include "core/linalg/simd.h"

// Functions that take or return vectors are inlined, so no caller sees the convention that the warning is about.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace dlcs {
namespace {

template <typename V>
inline constexpr Index kWidth = sizeof(V) / sizeof(double);

template <typename V>
DLCS_INLINE void Load(const double* from, V& value) {
  std::memcpy(&value, from, sizeof(V));
}

template <typename V>
DLCS_INLINE void Multiple(Index count, double factor, const double* x, double* y) {
  Index i = 0;
  for (; i + kWidth<V> <= count; i += kWidth<V>) {
    V left, right;
    Load(x + i, left);
    Load(y + i, right);
    right -= factor * left;
    std::memcpy(y + i, &right, sizeof(V));
  }
  for (; i < count; ++i) y[i] -= factor * x[i];
}

struct Product {
  Index rows, columns, depth;
  const double* L;
  Index L_stride;
  const double* U;
  Index U_stride;
  double* A;
  Index A_stride;
};

// The block of kVectors vectors of rows from i on, and kColumns columns from j on; it stays in registers.
template <typename V, int kVectors, int kColumns>
DLCS_INLINE void Tile(const Product& p, Index i, Index j) {
  V sums[kColumns][kVectors];
  for (int c = 0; c < kColumns; ++c) {
    for (int r = 0; r < kVectors; ++r) Load(p.A + (j + c) * p.A_stride + i + r * kWidth<V>, sums[c][r]);
  }
  for (Index k = 0; k < p.depth; ++k) {
    V left[kVectors];
    for (int r = 0; r < kVectors; ++r) Load(p.L + k * p.L_stride + i + r * kWidth<V>, left[r]);
    for (int c = 0; c < kColumns; ++c) {
      const double factor = p.U[(j + c) * p.U_stride + k];
      for (int r = 0; r < kVectors; ++r) sums[c][r] -= left[r] * factor;
    }
  }
  for (int c = 0; c < kColumns; ++c) {
    for (int r = 0; r < kVectors; ++r) {
      std::memcpy(p.A + (j + c) * p.A_stride + i + r * kWidth<V>, &sums[c][r], sizeof(V));
    }
  }
}

template <typename V, int kColumns>
DLCS_INLINE void Columns(const Product& p, Index j) {
  constexpr int kVectors = 3;  // with four columns, twelve sums fit into the sixteen registers of the baseline
  Index i = 0;
  for (; i + kVectors * kWidth<V> <= p.rows; i += kVectors * kWidth<V>) Tile<V, kVectors, kColumns>(p, i, j);
  for (; i + kWidth<V> <= p.rows; i += kWidth<V>) Tile<V, 1, kColumns>(p, i, j);
  for (; i < p.rows; ++i) Tile<double, 1, kColumns>(p, i, j);
}

template <typename V>
DLCS_INLINE void Subtract(const Product& p) {
  Index j = 0;
  for (; j + 4 <= p.columns; j += 4) Columns<V, 4>(p, j);
  for (; j < p.columns; ++j) Columns<V, 1>(p, j);
}

void MultipleBaseline(Index count, double factor, const double* x, double* y) {
  Multiple<Double2>(count, factor, x, y);
}
DLCS_TARGET("avx2") void MultipleAvx2(Index count, double factor, const double* x, double* y) {
  Multiple<Double4>(count, factor, x, y);
}
DLCS_TARGET("avx512f") void MultipleAvx512(Index count, double factor, const double* x, double* y) {
  Multiple<Double8>(count, factor, x, y);
}

void SubtractBaseline(const Product& p) { Subtract<Double2>(p); }
DLCS_TARGET("avx2") void SubtractAvx2(const Product& p) { Subtract<Double4>(p); }
DLCS_TARGET("avx512f") void SubtractAvx512(const Product& p) { Subtract<Double8>(p); }

}  // namespace

void SubtractLongMultiple(Index count, double factor, const double* x, double* y) {
  static const auto version = ChooseVersion(MultipleBaseline, MultipleAvx2, MultipleAvx512);
  version(count, factor, x, y);
}

void SubtractProduct(Index rows, Index columns, Index depth, const double* L, Index L_stride, const double* U,
                     Index U_stride, double* A, Index A_stride) {
  static const auto version = ChooseVersion(SubtractBaseline, SubtractAvx2, SubtractAvx512);
  version({rows, columns, depth, L, L_stride, U, U_stride, A, A_stride});
}

}  // namespace dlcs
