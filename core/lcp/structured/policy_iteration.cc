// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/policy_iteration.h"

#include <cmath>
#include <limits>
#include <type_traits>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/simd/simd.h"
#include "core/linalg/simd/simd_pack.h"

namespace dlcs {
namespace {

template <typename V>
using Truth = decltype(V{} < V{});  // bool, or lanes of which all bits are set or none

template <typename V>
DLCS_INLINE V Select(const Truth<V>& condition, const V& yes, const V& no) {
  return (V)((condition & (Truth<V>)yes) | (~condition & (Truth<V>)no));
}
DLCS_INLINE double Select(bool condition, double yes, double no) { return condition ? yes : no; }

template <typename V>
DLCS_INLINE V Abs(const V& value) {
  return (V)((Truth<V>)value & (Truth<V>{} + INT64_MAX));
}
DLCS_INLINE double Abs(double value) { return std::abs(value); }

// GCC 12 merges vector comparisons that are combined by & or | and then processes the lanes one by one. Hiding the
// comparison from the optimizer prevents this.
template <typename V>
DLCS_INLINE Truth<V> Opaque(const Truth<V>& condition) {
  Truth<V> result = condition;
#if defined(__x86_64__) && !defined(__clang__)
  if constexpr (!std::is_same_v<V, double>) asm("" : "+v"(result));
#endif
  return result;
}

template <typename V>
DLCS_INLINE Truth<V> Not(const Truth<V>& condition) {
  if constexpr (std::is_same_v<V, double>) {
    return !condition;
  } else {
    return ~condition;
  }
}

// The arrays of one problem (V = double), or of several: row i of an array is the `parts` vectors from i *
// parts on.
template <typename V, typename Basic>
struct Work {
  const Tridiagonal& M;
  const double* tolerance;
  const V* q;
  V* y;
  V* ratio;      // M_{i,i+1} over the pivot of i for i in S, else 0
  Basic* basic;  // is i in S
};

// The pivots of M_SS.
void FactorBasis(const Tridiagonal& M, const Basis& basis, std::vector<double>& ratios, std::vector<double>& inverses) {
  double ratio = 0;
  for (std::size_t k = 0; k < basis.size(); ++k) {
    const auto i = static_cast<Index>(k);
    if (basis[k]) {
      const double inverse = 1.0 / (M.diagonal[i] - M.below[i] * ratio);
      inverses[k] = inverse;
      ratio = M.above[i] * inverse;
    } else {
      ratio = 0;
    }
    ratios[k] = ratio;
  }
}

// Does the same as Eliminate(), with known pivots.
void EliminateAgain(const Work<double, std::uint8_t>& work, const double* inverse) {
  double y = 0;
  for (Index i = 0; i < work.M.size(); ++i) {
    y = work.basic[i] ? (0.0 - work.q[i] - work.M.below[i] * y) * inverse[i] : 0;
    work.y[i] = y;
  }
}

// y_S = -M_SS⁻¹ q_S in lanes, as far as it is known without the rows below.
template <int parts, typename V, typename Basic>
DLCS_INLINE void Eliminate(const Work<V, Basic>& work) {
  V ratio[parts] = {};
  V y[parts] = {};
  for (Index i = 0; i < work.M.size(); ++i) {
    const double below = work.M.below[i], diagonal = work.M.diagonal[i], above = work.M.above[i];
    for (int p = 0; p < parts; ++p) {
      const Index k = i * parts + p;
      const V inverse = 1.0 / (diagonal - below * ratio[p]);
      work.ratio[k] = ratio[p] = Select(work.basic[k], above * inverse, V{});
      work.y[k] = y[p] = Select(work.basic[k], (0.0 - work.q[k] - below * y[p]) * inverse, V{});
    }
  }
}

// Judges row i, at `k` in the arrays, by y_{i-1}, y_i and y_{i+1}, which are >= 0: where the certificate
// fails, `wrong` is set. Moves the index to the other side where it has to go, and returns whether it does.
template <typename V, typename Basic>
DLCS_INLINE Truth<V> Judge(const Work<V, Basic>& work, Index i, Index k, const V& left, const V& y, const V& right,
                           Truth<V>& wrong) {
  const V from_left = work.M.below[i] * left, own = work.M.diagonal[i] * y, from_right = work.M.above[i] * right;
  const V w = work.q[k] + from_left + own + from_right;
  const V size = Abs(work.q[k]) + Abs(from_left) + Abs(own) + Abs(from_right);
  const V allowed = work.tolerance[i] + kRowRounding * size;
  const Truth<V> basic = work.basic[k];
  const Truth<V> positive = Opaque<V>(y > 0.0);
  const Truth<V> accurate = Opaque<V>(Select(positive, Abs(w), 0.0 - w) <= allowed);
  const Truth<V> good = accurate & Opaque<V>(size <= std::numeric_limits<double>::max());  // false with NaN, too
  const Truth<V> moves = (basic & Not<V>(positive) & Opaque<V>(w > allowed)) | (Not<V>(basic) & Not<V>(good));
  work.basic[k] = basic ^ moves;
  wrong |= Not<V>(good);
  return moves;
}

// Completes y from the last row up, sets to zero what is negative, and judges each row when its neighbors
// are known.
template <int parts, typename V, typename Basic, typename Tally>
DLCS_INLINE void Substitute(const Work<V, Basic>& work, Tally* moved, Truth<V>* wrong) {
  V below[parts] = {};  // y of the row below, as the basis has it
  V right[parts] = {};
  V y[parts] = {};
  for (Index i = work.M.size() - 1; i >= 0; --i) {
    for (int p = 0; p < parts; ++p) {
      const Index k = i * parts + p;
      below[p] = work.y[k] - work.ratio[k] * below[p];
      const V next = Select(Opaque<V>(below[p] > 0.0), below[p], V{});
      work.y[k] = next;
      if (i + 1 < work.M.size()) moved[p] += Judge(work, i + 1, k + parts, next, y[p], right[p], wrong[p]);
      right[p] = y[p];
      y[p] = next;
    }
  }
  for (int p = 0; p < parts; ++p) moved[p] += Judge(work, 0, p, V{}, y[p], right[p], wrong[p]);
}

// Repeats rounds until no lane changes; bit l of the result is set if lane l is solved.
template <typename V>
DLCS_INLINE std::uint32_t Iterate(const Work<double, std::int64_t>& lanes) {
  constexpr int kWidth = sizeof(V) / sizeof(double);
  constexpr int kParts = PolicyLanes::kLanes / kWidth;
  const Work<V, Truth<V>> work{lanes.M,
                               lanes.tolerance,
                               reinterpret_cast<const V*>(lanes.q),
                               reinterpret_cast<V*>(lanes.y),
                               reinterpret_cast<V*>(lanes.ratio),
                               reinterpret_cast<Truth<V>*>(lanes.basic)};
  std::uint32_t solved = 0;
  bool moving = true;
  for (int round = 0; round < PolicyIteration::kPatience && moving; ++round) {
    Truth<V> moved[kParts] = {};
    Truth<V> wrong[kParts] = {};
    Eliminate<kParts>(work);
    Substitute<kParts>(work, moved, wrong);
    solved = 0;
    moving = false;
    for (int l = 0; l < PolicyLanes::kLanes; ++l) {
      const bool moves = moved[l / kWidth][l % kWidth] != 0;
      moving = moving || moves;
      if (!moves && wrong[l / kWidth][l % kWidth] == 0) solved |= 1u << l;
    }
  }
  return solved;
}

std::uint32_t IterateBaseline(const Work<double, std::int64_t>& lanes) { return Iterate<Double2>(lanes); }
DLCS_TARGET("avx2") std::uint32_t IterateAvx2(const Work<double, std::int64_t>& lanes) {
  return Iterate<Double4>(lanes);
}
DLCS_TARGET("avx512f") std::uint32_t IterateAvx512(const Work<double, std::int64_t>& lanes) {
  return Iterate<Double8>(lanes);
}

}  // namespace

bool PolicyIteration::Solve(const Tridiagonal& M, const Eigen::Ref<const Vector>& q,
                            const Eigen::Ref<const Vector>& tolerance, Basis& basis, Eigen::Ref<Vector> y,
                            Index& pivots) {
  factored_.clear();
  return SolveAgain(M, q, tolerance, basis, y, pivots);
}

bool PolicyIteration::SolveAgain(const Tridiagonal& M, const Eigen::Ref<const Vector>& q,
                                 const Eigen::Ref<const Vector>& tolerance, Basis& basis, Eigen::Ref<Vector> y,
                                 Index& pivots) {
  const Work<double, std::uint8_t> work{M, tolerance.data(), q.data(), y.data(), ratio_.data(), basis.data()};
  for (int round = 0; round < kPatience; ++round) {
    if (factored_ != basis) {
      FactorBasis(M, basis, ratio_, inverse_);
      factored_ = basis;
    }
    Index moved = 0;
    bool wrong = false;
    EliminateAgain(work, inverse_.data());
    Substitute<1>(work, &moved, &wrong);
    pivots += moved;
    if (moved == 0) return !wrong;
    // An index whose y_i and w_i are zero up to rounding may enter and leave S again and again. A round in which the
    // certificate holds is a solution.
    if (!wrong && round >= kPatience / 2) return true;
  }
  return false;
}

// Lanes left over solve LCP(0, M).
void PolicyLanes::ToRows(const Eigen::Ref<const Matrix>& columns, std::vector<Row>& rows) {
  const Index n = columns.rows(), whole = columns.cols() / 8 * 8;
  for (Index l = 0; l < whole; l += 8) {
    ColumnsToLanes(columns.col(l).data(), columns.outerStride(), n, rows[0].lane + l, kLanes);
  }
  for (Index j = whole; j < kLanes; ++j) {
    for (Index i = 0; i < n; ++i) rows[i].lane[j] = j < columns.cols() ? columns(i, j) : 0;
  }
}

std::uint32_t PolicyLanes::Solve(const Tridiagonal& M, const Eigen::Ref<const Matrix>& q,
                                 const Eigen::Ref<const Vector>& tolerance, Eigen::Ref<Matrix> y) {
  static const auto solve = ChooseVersion(IterateBaseline, IterateAvx2, IterateAvx512);
  const Index n = M.size(), columns = q.cols();
  const std::uint32_t all = (1u << columns) - 1;
  ToRows(q, q_);
  ToRows(y, y_);
  RunWide([n, guesses = y_[0].lane, bits = basic_[0].lane]() DLCS_WIDE {
    const double* __restrict guess = guesses;
    std::int64_t* __restrict basic = bits;
    for (Index k = 0; k < n * kLanes; ++k) basic[k] = guess[k] > 0 ? -1 : 0;
  });
  const std::uint32_t solved =
      all & solve({M, tolerance.data(), q_[0].lane, y_[0].lane, ratio_[0].lane, basic_[0].lane});
  if (solved == all && columns == kLanes) {
    for (Index l = 0; l < kLanes; l += 8) {
      LanesToColumns(y_[0].lane + l, kLanes, n, y.col(l).data(), y.outerStride());
    }
    return solved;
  }
  for (Index j = 0; j < columns; ++j) {
    if ((solved >> j & 1) == 0) continue;
    for (Index i = 0; i < n; ++i) y(i, j) = y_[i].lane[j];
  }
  return solved;
}

}  // namespace dlcs
