// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/simd/elimination_loops.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linalg/simd/simd.h"

namespace dlcs {
namespace {

constexpr Index kBlock = 8;  // columns of a triangle that are substituted together

template <typename V>
inline constexpr Index kWidth = sizeof(V) / sizeof(double);

template <typename V>
struct HalfOf {
  using type = double;
};
template <>
struct HalfOf<Double4> {
  using type = Double2;
};
template <>
struct HalfOf<Double8> {
  using type = Double4;
};
template <typename V>
using Half = typename HalfOf<V>::type;

template <typename V>
DLCS_INLINE void Multiple(Index count, double factor, const double* x, double* y) {
  Index i = 0;
  for (; i + kWidth<V> <= count; i += kWidth<V>) {
    Store(V(Load<V>(y + i) - factor * Load<V>(x + i)), y + i);
  }
  if constexpr (kWidth < V >> 1) Multiple<Half<V>>(count - i, factor, x + i, y + i);
}

struct BlockProduct {
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
DLCS_INLINE void Tile(const BlockProduct& p, Index i, Index j) {
  V sums[kColumns][kVectors];
  for (int c = 0; c < kColumns; ++c) {
    for (int r = 0; r < kVectors; ++r) sums[c][r] = Load<V>(p.A + (j + c) * p.A_stride + i + r * kWidth<V>);
  }
  for (Index k = 0; k < p.depth; ++k) {
    V left[kVectors];
    for (int r = 0; r < kVectors; ++r) left[r] = Load<V>(p.L + k * p.L_stride + i + r * kWidth<V>);
    for (int c = 0; c < kColumns; ++c) {
      const double factor = p.U[(j + c) * p.U_stride + k];
      for (int r = 0; r < kVectors; ++r) sums[c][r] -= left[r] * factor;
    }
  }
  for (int c = 0; c < kColumns; ++c) {
    for (int r = 0; r < kVectors; ++r) {
      Store(sums[c][r], p.A + (j + c) * p.A_stride + i + r * kWidth<V>);
    }
  }
}

// Processes the rows from i on in vectors V, and the remaining rows in shorter vectors.
template <typename V, int kColumns>
DLCS_INLINE void ColumnsOf(const BlockProduct& p, Index i, Index j) {
  constexpr int kVectors = 3;  // with four columns, twelve sums fit into the sixteen registers of the baseline
  for (; i + kVectors * kWidth<V> <= p.rows; i += kVectors * kWidth<V>) Tile<V, kVectors, kColumns>(p, i, j);
  for (; i + kWidth<V> <= p.rows; i += kWidth<V>) Tile<V, 1, kColumns>(p, i, j);
  if constexpr (kWidth < V >> 1) ColumnsOf<Half<V>, kColumns>(p, i, j);
}

template <typename V>
DLCS_INLINE void Subtract(const BlockProduct& p) {
  Index j = 0;
  for (; j + 4 <= p.columns; j += 4) ColumnsOf<V, 4>(p, 0, j);
  for (; j < p.columns; ++j) ColumnsOf<V, 1>(p, 0, j);
}

struct Combination {
  Index rows;
  std::span<const Index> columns;
  const double* x;
  const double* M;
  double* w;
};

// kVectors vectors of rows from i on; their sums stay in registers.
template <typename V, int kVectors>
DLCS_INLINE void Rows(const Combination& c, Index i) {
  V sums[kVectors];
  for (int r = 0; r < kVectors; ++r) sums[r] = Load<V>(c.w + i + r * kWidth<V>);
  for (std::size_t k = 0; k < c.columns.size(); ++k) {
    const double* const column = c.M + c.columns[k] * c.rows + i;
    for (int r = 0; r < kVectors; ++r) sums[r] += c.x[k] * Load<V>(column + r * kWidth<V>);
  }
  for (int r = 0; r < kVectors; ++r) Store(sums[r], c.w + i + r * kWidth<V>);
}

template <typename V>
DLCS_INLINE void Combine(const Combination& c, Index i = 0) {
  for (; i + 4 * kWidth<V> <= c.rows; i += 4 * kWidth<V>) Rows<V, 4>(c, i);
  for (; i + kWidth<V> <= c.rows; i += kWidth<V>) Rows<V, 1>(c, i);
  if constexpr (kWidth < V >> 1) Combine<Half<V>>(c, i);
}

struct Panel {
  Index begin, end, size;
  double zero;
  double* LU;
  Index stride;
  double* inverse;
  Index* source;
};

template <typename V>
DLCS_INLINE bool Eliminate(const Panel& e) {
  for (Index p = e.begin; p < e.end; ++p) {
    double* const column = e.LU + p * e.stride;
    Index row = p;
    for (Index i = p + 1; i < e.size; ++i) {
      if (std::abs(column[i]) > std::abs(column[row])) row = i;
    }
    if (row != p) {
      std::swap(e.source[p], e.source[row]);
      for (Index j = 0; j < e.size; ++j) std::swap(e.LU[j * e.stride + p], e.LU[j * e.stride + row]);
    }
    if (!(std::abs(column[p]) > e.zero)) return false;
    e.inverse[p] = 1 / column[p];
    for (Index i = p + 1; i < e.size; ++i) column[i] *= e.inverse[p];
    for (Index j = p + 1; j < e.end; ++j) {
      double* const other = e.LU + j * e.stride;
      Multiple<V>(e.size - p - 1, other[p], column + p + 1, other + p + 1);
    }
  }
  return true;
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

void SubtractBaseline(const BlockProduct& p) { Subtract<Double2>(p); }
DLCS_TARGET("avx2") void SubtractAvx2(const BlockProduct& p) { Subtract<Double4>(p); }
DLCS_TARGET("avx512f") void SubtractAvx512(const BlockProduct& p) { Subtract<Double8>(p); }

bool EliminateBaseline(const Panel& e) { return Eliminate<Double2>(e); }
DLCS_TARGET("avx2") bool EliminateAvx2(const Panel& e) { return Eliminate<Double4>(e); }
DLCS_TARGET("avx512f") bool EliminateAvx512(const Panel& e) { return Eliminate<Double8>(e); }

void CombineBaseline(const Combination& c) { Combine<Double2>(c); }
DLCS_TARGET("avx2") void CombineAvx2(const Combination& c) { Combine<Double4>(c); }
DLCS_TARGET("avx512f") void CombineAvx512(const Combination& c) { Combine<Double8>(c); }

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

void AddLongColumns(Index rows, std::span<const Index> columns, const double* x, const double* M, double* w) {
  static const auto version = ChooseVersion(CombineBaseline, CombineAvx2, CombineAvx512);
  version({rows, columns, x, M, w});
}

bool EliminateColumns(Index begin, Index end, Index size, double zero, double* LU, Index LU_stride, double* inverse,
                      Index* source) {
  static const auto version = ChooseVersion(EliminateBaseline, EliminateAvx2, EliminateAvx512);
  return version({begin, end, size, zero, LU, LU_stride, inverse, source});
}

void SubstituteLongForward(Index size, const double* LU, Index LU_stride, double* x) {
  for (Index begin = 0; begin < size; begin += kBlock) {
    const Index end = std::min(begin + kBlock, size);
    const double* const block = LU + begin * LU_stride + begin;
    for (Index p = 0; p < end - begin; ++p) {
      for (Index i = p + 1; i < end - begin; ++i) x[begin + i] -= x[begin + p] * block[p * LU_stride + i];
    }
    if (end == size) break;
    SubtractProduct(size - end, 1, end - begin, block + (end - begin), LU_stride, x + begin, size, x + end, size);
  }
}

void SubstituteLongBackward(Index size, const double* LU, Index LU_stride, const double* inverse, double* x) {
  Index end = size;
  while (end > 0) {
    const Index begin = (end - 1) / kBlock * kBlock;
    const double* const columns = LU + begin * LU_stride;
    for (Index p = end - 1; p >= begin; --p) {
      x[p] *= inverse[p];
      for (Index i = begin; i < p; ++i) x[i] -= x[p] * columns[(p - begin) * LU_stride + i];
    }
    if (begin == 0) break;
    SubtractProduct(begin, 1, end - begin, columns, LU_stride, x + begin, size, x, size);
    end = begin;
  }
}

}  // namespace dlcs
